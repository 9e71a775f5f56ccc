/** The quick look during editing: renders the newest wish, with at most one job at a time, and none once it is closed. Pure. */

export interface QuickJobs<Wish> {
  submit(wish: Wish): Promise<bigint>;
  /** Cancels and deletes a job in any state. */
  discard(job: bigint): Promise<void>;
}

export interface QuickListener {
  onJob(job: bigint | undefined): void;
  /** Empty: it works again. */
  onFailure(message: string): void;
}

export class QuickLook<Wish> {
  private waiting: Wish | undefined;
  private job: bigint | undefined;
  /** Jobs that could not be deleted yet. */
  private readonly left = new Set<bigint>();
  private busy: Promise<void> | undefined;
  private closed = false;

  constructor(
    private readonly jobs: QuickJobs<Wish>,
    private readonly listener: QuickListener,
  ) {}

  /** Sets what to render. An older wish that waits is dropped. */
  want(wish: Wish): void {
    if (!this.closed) {
      this.waiting = wish;
      this.busy ??= this.work();
    }
  }

  /** The current job. */
  get current(): bigint | undefined {
    return this.job;
  }

  /** Leaves its jobs alone: another farm answers now. */
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
    // Several wishes in the same turn count as one.
    await Promise.resolve();
    while (this.waiting !== undefined) {
      const wish = this.waiting;
      this.waiting = undefined;
      try {
        await this.discard().catch(() => undefined);
        this.job = await this.jobs.submit(wish);
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
