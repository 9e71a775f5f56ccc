/** The live picture during editing: renders the newest request, with at most one job at a time, and none once it is closed. Pure. */

export interface LivePictureJobs<Request> {
  submit(request: Request): Promise<bigint>;
  /** Cancels and deletes a job in any state. */
  discard(job: bigint): Promise<void>;
}

export interface LivePictureListener {
  onJob(job: bigint | undefined): void;
  /** Empty: the failure is over. */
  onFailure(message: string): void;
}

export class LivePicture<Request> {
  private waiting: Request | undefined;
  private job: bigint | undefined;
  /** Jobs that could not be deleted yet. */
  private readonly left = new Set<bigint>();
  private busy: Promise<void> | undefined;
  private closed = false;

  constructor(
    private readonly jobs: LivePictureJobs<Request>,
    private readonly listener: LivePictureListener,
  ) {}

  /** Sets what to render. An older request that waits is dropped. */
  want(request: Request): void {
    if (!this.closed) {
      this.waiting = request;
      this.busy ??= this.work();
    }
  }

  /** The current job. */
  get current(): bigint | undefined {
    return this.job;
  }

  /** Forgets its jobs without deleting them, because another farm answers now. */
  forget(): void {
    this.job = undefined;
    this.left.clear();
  }

  /** Resolves once none of its jobs is left. */
  async close(): Promise<void> {
    this.closed = true;
    this.waiting = undefined;
    await this.busy;
    await this.discard();
  }

  private async work(): Promise<void> {
    // Several requests in the same turn of the event loop count as one.
    await Promise.resolve();
    while (this.waiting !== undefined) {
      const request = this.waiting;
      this.waiting = undefined;
      try {
        await this.discard().catch(() => undefined);
        this.job = await this.jobs.submit(request);
        this.listener.onFailure('');
        this.listener.onJob(this.job);
      } catch (error) {
        this.listener.onFailure(error instanceof Error ? error.message : String(error));
      }
    }
    this.busy = undefined;
  }

  /** Throws if a job could not be deleted. The next call retries. */
  private async discard(): Promise<void> {
    if (this.job !== undefined) {
      this.left.add(this.job);
      this.job = undefined;
    }
    for (const job of [...this.left]) {
      await this.jobs.discard(job);
      this.left.delete(job);
    }
  }
}
