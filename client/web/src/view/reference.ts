/** The reference of a job's picture: another job, or a file that the user chose. */
import {useMemo, useState} from 'preact/hooks';
import {partBelow, type Against} from '../model/comparison';
import {readExr, type ExrPicture} from '../model/exr';
import {Film} from '../model/film';
import {useOtherJob} from './other_job';

export interface ReferenceFile {
  name: string;
  picture: ExrPicture;
}

export interface Reference {
  name: string;
  /** The reference's film, of the size of the job's; undefined until it arrives. */
  film: Film | undefined;
  failure: string;
}

function fitting(name: string, film: Film, width: number, height: number): string {
  const {crop} = film;
  return `${name} has ${width}×${height} pixels, this picture ${crop.width}×${crop.height}: choose one of the same size.`;
}

/** A file's picture as a film with the crop of `film`. */
function filmOfFile(file: ReferenceFile, film: Film): Reference {
  const {name, picture} = file;
  const rgb = partBelow(picture, film.crop);
  return rgb ? {name, film: Film.still(film.crop, rgb), failure: ''} : {name, film: undefined, failure: fitting(name, film, picture.window.width, picture.window.height)};
}

export function useReference(film: Film | undefined, against: Against | undefined, file: ReferenceFile | undefined): Reference | undefined {
  const asked = against?.other;
  const job = useOtherJob(typeof asked === 'bigint' ? asked : undefined);
  return useMemo(() => {
    if (asked === undefined || !film) {
      return undefined;
    }
    if (asked === 'file') {
      return file ? filmOfFile(file, film) : {name: 'a file', film: undefined, failure: 'The link does not contain the reference file. Choose it again, or drop it on the picture.'};
    }
    const name = job.job?.name ? `${job.job.name} #${asked}` : `job ${asked}`;
    if (job.film && (job.film.crop.width !== film.crop.width || job.film.crop.height !== film.crop.height)) {
      return {name, film: undefined, failure: fitting(name, film, job.film.crop.width, job.film.crop.height)};
    }
    return {name, film: job.film, failure: job.failure};
  }, [film, asked, file, job]);
}

/** The chosen file, the function that chooses another, and why that failed. */
export function useReferenceFile(): [ReferenceFile | undefined, (file: File) => Promise<boolean>, string] {
  const [chosen, setChosen] = useState<ReferenceFile>();
  const [failure, setFailure] = useState('');
  const choose = async (file: File) => {
    try {
      setChosen({name: file.name, picture: await readExr(new Uint8Array(await file.arrayBuffer()))});
      setFailure('');
      return true;
    } catch (error) {
      setFailure(`${file.name}: ${error instanceof Error ? error.message : String(error)}`);
      return false;
    }
  };
  return [chosen, choose, failure];
}
