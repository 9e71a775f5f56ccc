/** A worker as the page shows it. */
import type {Worker} from '../wire/lightmill/v1/farm_pb';

/** Its state in a word or two, and the job state whose colour it has. */
export function healthOf(worker: Worker): {name: string; kind: string} {
  if (worker.quarantine) {
    return {name: worker.away ? 'quarantine, away' : 'quarantine', kind: 'failed'};
  }
  if (worker.draining) {
    return {name: 'draining', kind: 'paused'};
  }
  return worker.leases > 0 ? {name: 'rendering', kind: 'running'} : {name: 'idle', kind: 'queued'};
}
