/** A lab's results from a local file, which is not uploaded: a chart for each scene. */
import {useRef, useState} from 'preact/hooks';
import {parseLabReport, type LabReport, type LabScene} from '../model/lab_report';
import {CsvButton, LineList, Plot} from './error_chart';

const kNoCurve = {points: [], target: undefined, finish: undefined, guides: []};

function SceneChart({scene, theme}: {scene: LabScene; theme: string}) {
  const [hover, setHover] = useState<number>();
  const {name, lines} = scene;
  if (lines.every((line) => line.points.length === 0)) {
    return <p class="muted">There are no results yet.</p>;
  }
  return (
    <figure class="chart">
      <Plot curve={kNoCurve} others={lines} text={`scene ${name}`} theme={theme} onHover={setHover} />
      <figcaption>
        <LineList lines={lines} hover={hover} label={`Methods on ${name}`} />
        <div class="chart-actions">
          <CsvButton lines={lines} name={`lab-${name}`} />
        </div>
      </figcaption>
    </figure>
  );
}

export function LabPage({theme}: {theme: string}) {
  const [report, setReport] = useState<LabReport>();
  const [failure, setFailure] = useState('');
  const input = useRef<HTMLInputElement>(null);
  const open = async (file: File | undefined) => {
    if (!file) {
      return;
    }
    try {
      setReport(parseLabReport(await file.text()));
      setFailure('');
    } catch (error) {
      setFailure(`${file.name}: ${error instanceof Error ? error.message : String(error)}`);
    }
  };
  const onDrop = (event: DragEvent) => {
    event.preventDefault();
    void open(event.dataTransfer?.files[0]);
  };
  return (
    <section class="page lab" onDragOver={(event) => event.preventDefault()} onDrop={onDrop}>
      <div class="toolbar">
        <h1>{report?.title || 'Lab'}</h1>
        <button type="button" onClick={() => input.current!.click()}>
          Open results.json…
        </button>
        <input
          ref={input}
          type="file"
          accept=".json"
          class="sr-only"
          aria-label="The results.json of a lab"
          tabIndex={-1}
          onChange={(event) => {
            const file = event.currentTarget.files?.[0];
            event.currentTarget.value = '';
            void open(file);
          }}
        />
      </div>
      {failure && (
        <p class="notice failure" role="alert">
          {failure}
        </p>
      )}
      {!report && (
        <p class="empty">
          Drop the <code>results.json</code> of <code>lightmill lab EXPERIMENT -o DIR</code> here, or open it. The page charts error against time for each scene and method. The file stays in this browser.
        </p>
      )}
      <div class="lab-scenes">
        {report?.scenes.map((scene) => (
          <section class="panel" key={scene.name} aria-label={scene.name}>
            <h2>{scene.name}</h2>
            {scene.reference && <p class="muted">Reference: {scene.reference}</p>}
            <SceneChart scene={scene} theme={theme} />
          </section>
        ))}
      </div>
    </section>
  );
}
