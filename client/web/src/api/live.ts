/** The WebSocket to the coordinator. It sends what the page wants to watch, passes on messages, and reconnects when it breaks. */
import {create, fromBinary, toBinary} from '@bufbuild/protobuf';
import {hexOf} from '../model/bytes';
import {isSilent, kNoLongerAllowed, retryDelayMs, type Link} from '../model/connection';
import {ViewRequestSchema, ViewUpdateSchema, type ViewUpdate} from '../wire/lightmill/v1/web_pb';
import {needsLogin} from './session';

export interface Wants {
  jobs: boolean;
  workers: boolean;
  /** The watched job; 0n: none. */
  job: bigint;
  /** Layers that are watched beside beauty. */
  layers?: readonly string[];
}

export interface LiveListener {
  onLink(link: Link): void;
  /** In the order of sending. After a break everything wanted comes again. */
  onUpdate(update: ViewUpdate): void;
}

const kCheckMs = 1_000;

/** The id of this page. Jobs submitted for it are deleted after its last connection has ended. */
export const kPage = hexOf(crypto.getRandomValues(new Uint8Array(16)));

export class Live {
  private wants: Wants = {jobs: false, workers: false, job: 0n};
  private socket: WebSocket | undefined;
  private seen = 0n;
  private failures = 0;
  private lastHeardMs = 0;
  private retry: ReturnType<typeof setTimeout> | undefined;
  private readonly closing = new AbortController();
  private readonly check = setInterval(() => this.checkForSilence(), kCheckMs);

  constructor(private readonly listener: LiveListener) {
    const {signal} = this.closing;
    document.addEventListener('visibilitychange', () => this.onVisibility(), {signal});
    window.addEventListener('online', () => this.connectNow(), {signal});
    this.connect();
  }

  /** Closes the connection for good. */
  close(): void {
    this.closing.abort();
    clearInterval(this.check);
    clearTimeout(this.retry);
    this.retry = undefined;
    const socket = this.socket;
    this.socket = undefined;
    socket?.close();
  }

  want(wants: Wants): void {
    this.wants = wants;
    this.say();
  }

  /** Connects as another user, after a login or logout. */
  begin(): void {
    const before = this.socket;
    this.socket = undefined;
    before?.close();
    this.failures = 0;
    this.connect();
  }

  connectNow(): void {
    if (this.retry !== undefined) {
      this.connect();
    }
  }

  private connect(): void {
    clearTimeout(this.retry);
    this.retry = undefined;
    const address = new URL('api/v1/live', window.location.href);
    address.protocol = address.protocol === 'https:' ? 'wss:' : 'ws:';
    address.hash = '';
    const socket = new WebSocket(address);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    this.seen = 0n;
    this.lastHeardMs = Date.now();
    if (this.failures === 0) {
      this.listener.onLink('connecting');
    }
    socket.onopen = () => this.say();
    socket.onmessage = (event: MessageEvent<ArrayBuffer>) => this.take(socket, event.data);
    socket.onclose = (event) => void this.onClose(socket, event.code);
  }

  private take(socket: WebSocket, bytes: ArrayBuffer): void {
    if (socket !== this.socket) {
      return;
    }
    this.lastHeardMs = Date.now();
    this.failures = 0;
    this.seen += 1n;
    this.listener.onLink('connected');
    this.listener.onUpdate(fromBinary(ViewUpdateSchema, new Uint8Array(bytes)));
    // Sent after the update is drawn, so a page that draws slowly gets fewer updates.
    requestAnimationFrame(() => this.say());
  }

  /** Asks whether a connection was refused, because a refused one looks like a lost one. */
  private async onClose(socket: WebSocket, code: number): Promise<void> {
    const heard = this.seen > 0n;
    if (code === kNoLongerAllowed || (!heard && (await needsLogin()))) {
      if (socket === this.socket) {
        this.socket = undefined;
        this.listener.onLink('closed');
      }
      return;
    }
    this.onBreak(socket);
  }

  private onBreak(socket: WebSocket): void {
    if (socket !== this.socket) {
      return;
    }
    this.socket = undefined;
    this.failures += 1;
    this.listener.onLink('lost');
    this.retry = setTimeout(() => this.connect(), retryDelayMs(this.failures, Math.random()));
  }

  private onVisibility(): void {
    this.lastHeardMs = Date.now();
    this.say();
    if (!document.hidden) {
      this.connectNow();
    }
  }

  private checkForSilence(): void {
    const socket = this.socket;
    if (socket && isSilent(this.lastHeardMs, Date.now(), document.hidden)) {
      socket.close();
      this.onBreak(socket);
    }
  }

  private say(): void {
    if (this.socket?.readyState === WebSocket.OPEN) {
      const request = create(ViewRequestSchema, {...this.wants, layers: [...(this.wants.layers ?? [])], hidden: document.hidden, seen: this.seen, page: kPage});
      this.socket.send(toBinary(ViewRequestSchema, request));
    }
  }
}
