/** The state of the farm for components: a small store that the live connection fills. */
import {useEffect, useState} from 'preact/hooks';
import {Live} from '../api/live';
import type {Link} from '../model/connection';
import {Film, type Rect} from '../model/film';
import {kNoFailures, withLayerFailures, type LayerFailures} from '../model/layers';
import {withJobs, withWorkers, type JobList, type WorkerList} from '../model/jobs';
import type {Job} from '../wire/lightmill/v1/farm_pb';
import type {FarmGreeting, ViewTile, ViewUpdate} from '../wire/lightmill/v1/web_pb';

export interface FarmState {
  link: Link;
  greeting: FarmGreeting | undefined;
  jobs: JobList;
  workers: WorkerList;
  /** Whether the lists have arrived. */
  listed: boolean;
  /** The watched job, with its history. */
  job: Job | undefined;
  jobFailure: string;
  film: Film | undefined;
  /** The watched layers of the job, as they arrive. */
  layers: ReadonlyMap<string, Film>;
  layerFailures: LayerFailures;
}

const kNoLayers: ReadonlyMap<string, Film> = new Map();

/** Gets the tiles that changed in a film, to draw them. */
export type TileListener = (film: Film, tiles: {rect: Rect; pixels: Uint16Array}[]) => void;

type Listener = () => void;

class FarmStore {
  state: FarmState = {
    link: 'connecting',
    greeting: undefined,
    jobs: new Map(),
    workers: new Map(),
    listed: false,
    job: undefined,
    jobFailure: '',
    film: undefined,
    layers: kNoLayers,
    layerFailures: kNoFailures,
  };
  private readonly listeners = new Set<Listener>();
  private readonly tileListeners = new Set<TileListener>();
  private watched = 0n;
  private wantedLayers: readonly string[] = [];
  private readonly live = new Live({
    onLink: (link) => {
      if (link !== this.state.link) {
        this.set({link});
      }
    },
    onUpdate: (update) => this.take(update),
  });

  /** Sets the watched job; 0n: none. */
  watch(job: bigint): void {
    if (job !== this.watched) {
      this.watched = job;
      this.wantedLayers = [];
      this.set({job: undefined, film: undefined, layers: kNoLayers, jobFailure: '', layerFailures: kNoFailures});
    }
    this.want();
  }

  /** Sets the layers of that job that are watched beside beauty. Pixels so far are kept. */
  watchLayers(layers: readonly string[]): void {
    if (layers.join() !== this.wantedLayers.join()) {
      this.wantedLayers = layers;
      // A layer's failure is reported again when it is watched again.
      const kept = [...this.state.layerFailures].filter(([layer]) => layer === '' || layers.includes(layer));
      this.set({layerFailures: new Map(kept)});
      this.want();
    }
  }

  private want(): void {
    this.live.want({jobs: true, workers: true, job: this.watched, layers: this.wantedLayers});
  }

  connectNow(): void {
    this.live.connectNow();
  }

  /** Starts as another user: forgets everything, and reconnects. */
  begin(): void {
    this.set({greeting: undefined, jobs: new Map(), workers: new Map(), listed: false, job: undefined, jobFailure: '', film: undefined, layers: kNoLayers});
    this.live.begin();
  }

  subscribe(listener: Listener): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  onTiles(listener: TileListener): () => void {
    this.tileListeners.add(listener);
    return () => this.tileListeners.delete(listener);
  }

  private take(update: ViewUpdate): void {
    const next: Partial<FarmState> = {};
    if (update.greeting) {
      next.greeting = update.greeting;
      next.layerFailures = kNoFailures;
    }
    if (update.jobs) {
      next.jobs = withJobs(this.state.jobs, update.jobs);
      next.listed = true;
    }
    if (update.workers) {
      next.workers = withWorkers(this.state.workers, update.workers);
    }
    if (update.jobFailure) {
      next.jobFailure = update.jobFailure;
    }
    const failures = update.layerFailures.filter(({job}) => job === this.watched);
    if (failures.length > 0) {
      next.layerFailures = withLayerFailures(next.layerFailures ?? this.state.layerFailures, failures);
    }
    if (update.job && update.job.id === this.watched) {
      next.job = update.job;
      next.jobFailure = '';
      if (!this.state.film?.isOf(update.job)) {
        next.film = Film.of(update.job);
        next.layers = kNoLayers;
      }
    }
    this.set(next);
    this.putLayers(update.tiles);
  }

  private putLayers(tiles: readonly ViewTile[]): void {
    this.putTiles(this.state.film, tiles.filter(({layer}) => layer === ''));
    const {job} = this.state;
    for (const layer of new Set(tiles.map((tile) => tile.layer))) {
      if (layer !== '' && job) {
        if (!this.state.layers.has(layer)) {
          this.set({layers: new Map(this.state.layers).set(layer, Film.of(job, layer))});
        }
        this.putTiles(this.state.layers.get(layer), tiles.filter((tile) => tile.layer === layer));
      }
    }
  }

  /** Puts tiles into a film, this store's or another, and tells its listeners. */
  putTiles(film: Film | undefined, tiles: readonly ViewTile[]): void {
    if (film && tiles.length > 0) {
      this.tell(film, tiles.map((tile) => film.put(tile)).filter((tile) => tile !== undefined));
    }
  }

  /** Tells the listeners what has changed in the film. */
  tell(film: Film, tiles: {rect: Rect; pixels: Uint16Array}[]): void {
    this.tileListeners.forEach((listener) => listener(film, tiles));
  }

  private set(next: Partial<FarmState>): void {
    if (Object.keys(next).length > 0) {
      this.state = {...this.state, ...next};
      this.listeners.forEach((listener) => listener());
    }
  }
}

export const farm = new FarmStore();

/** Whether the film has a tile. */
export function useHasTiles(film: Film | undefined): boolean {
  const [has, setHas] = useState(false);
  useEffect(() => {
    setHas(film?.counts.some((count) => count > 0) ?? false);
    return farm.onTiles((changed) => changed === film && setHas(true));
  }, [film]);
  return has;
}

export function useFarm(): FarmState {
  const [state, setState] = useState(farm.state);
  useEffect(() => {
    setState(farm.state);
    return farm.subscribe(() => setState(farm.state));
  }, []);
  return state;
}
