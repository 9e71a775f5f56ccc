/** The WebSocket to the coordinator: says what the page wants to know, hands on what comes, and connects again when it breaks. */
import {create, fromBinary, toBinary} from '@bufbuild/protobuf';
import {hexOf} from '../model/bytes';
import {isSilent, kNoLongerAllowed, retryDelayMs, type Link} from '../model/connection';
import {ViewRequestSchema, ViewUpdateSchema, type ViewUpdate} from '../wire/lightmill/v1/web_pb';
import {needsLogin} from './session';

export interface Wants {
  jobs: boolean;
  workers: boolean;
  /** The job that is looked at; 0n: none. */
  job: bigint;
  /** Whose pixels come beside those of beauty. */
  layers?: readonly string[];
}

export interface LiveListener {
  onLink(link: Link): void;
  /** In the order in which they were sent. After a break everything wanted comes again. */
  onUpdate(update: ViewUpdate): void;
}

const kLookMs = 1_000;

/** By which the coordinator knows this page: jobs that are submitted for it end with its last connection. */
export const kPage = hexOf(crypto.getRandomValues(new Uint8Array(16)));

export class Live {
  private wants: Wants = {jobs: false, workers: false, job: 0n};
  private socket: WebSocket | undefined;
  private seen = 0n;
  private failures = 0;
  private lastHeardMs = 0;
  private retry: ReturnType<typeof setTimeout> | undefined;
  private readonly closing = new AbortController();
  private readonly look = setInterval(() => this.lookForSilence(), kLookMs);

  constructor(private readonly listener: LiveListener) {
    const {signal} = this.closing;
    document.addEventListener('visibilitychange', () => this.onVisibility(), {signal});
    window.addEventListener('online', () => this.connectNow(), {signal});
    this.connect();
  }

  /** Ends the connection for good. */
  close(): void {
    this.closing.abort();
    clearInterval(this.look);
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

  /** Connects as somebody else: who has just logged in or out. */
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
    // Told once what came is drawn: a page that draws slowly is sent less.
    requestAnimationFrame(() => this.say());
  }

  /** A refused connection looks like a lost one: whether it was refused is asked. */
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

  private lookForSilence(): void {
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
