/** Keeps one small job for what is being edited: the newest wish, at most one job at a time, none once it is closed. Pure. */

export interface QuickJobs<Wish> {
  submit(wish: Wish): Promise<bigint>;
  /** Ends and forgets a job, whatever state it is in. */
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
  /** Those that could not be discarded yet. */
  private readonly left = new Set<bigint>();
  private busy: Promise<void> | undefined;
  private closed = false;

  constructor(
    private readonly jobs: QuickJobs<Wish>,
    private readonly listener: QuickListener,
  ) {}

  /** What is to be seen from now on; a wish that waits is forgotten. */
  want(wish: Wish): void {
    if (!this.closed) {
      this.waiting = wish;
      this.busy ??= this.work();
    }
  }

  /** The job that is there now. */
  get current(): bigint | undefined {
    return this.job;
  }

  /** Ends once no job of it is left. */
  async close(): Promise<void> {
    this.closed = true;
    this.waiting = undefined;
    await this.busy;
    await this.discard();
  }

  private async work(): Promise<void> {
    // What is wanted at once, one after the other, is one wish.
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

  /** Throws if one could not be; it is tried again the next time. */
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
