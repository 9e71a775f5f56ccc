/** The frame of the page: route, theme and connection. */
import {useEffect, useState} from 'preact/hooks';
import {parseRoute, type Route} from '../model/route';
import {JobPage, useWatch} from './job_page';
import {JobsPage} from './jobs_page';
import {LabPage} from './lab_page';
import {LoginPage, LogOut} from './login';
import {farm, useFarm} from './store';
import {WorkersPage} from './workers_page';

function useRoute(): Route {
  const [route, setRoute] = useState(() => parseRoute(window.location.hash));
  useEffect(() => {
    const onHash = () => setRoute(parseRoute(window.location.hash));
    window.addEventListener('hashchange', onHash);
    return () => window.removeEventListener('hashchange', onHash);
  }, []);
  return route;
}

type Theme = 'auto' | 'light' | 'dark';
const kThemes: Theme[] = ['auto', 'light', 'dark'];

function useTheme(): [Theme, string, () => void] {
  const [theme, setTheme] = useState<Theme>(() => kThemes.find((each) => each === localStorage.getItem('theme')) ?? 'auto');
  const [system, setSystem] = useState(matchMedia('(prefers-color-scheme: dark)').matches);
  useEffect(() => {
    const query = matchMedia('(prefers-color-scheme: dark)');
    const onChange = () => setSystem(query.matches);
    query.addEventListener('change', onChange);
    return () => query.removeEventListener('change', onChange);
  }, []);
  const resolved = theme === 'auto' ? (system ? 'dark' : 'light') : theme;
  document.documentElement.dataset.theme = resolved;
  const next = () => {
    const chosen = kThemes[(kThemes.indexOf(theme) + 1) % kThemes.length]!;
    localStorage.setItem('theme', chosen);
    setTheme(chosen);
  };
  return [theme, resolved, next];
}

const kLinkTexts = {connecting: 'connecting…', connected: 'live', lost: 'connection lost', closed: 'not logged in'};

function Header({route, theme, onTheme}: {route: Route; theme: Theme; onTheme: () => void}) {
  const {link, jobs, workers} = useFarm();
  const here = (page: string) => (route.page === page || (page === 'jobs' && route.page === 'job') ? 'page' : undefined);
  return (
    <header class="top">
      <a class="brand" href="#/jobs" aria-label="Lightmill, all jobs">
        <svg viewBox="0 0 24 24" width="22" height="22" aria-hidden="true">
          <circle cx="12" cy="12" r="10" fill="none" stroke="currentColor" stroke-width="1.6" />
          <path d="M12 4v16M4 12h16" stroke="currentColor" stroke-width="1" opacity=".5" />
          <path d="M12 5.5l5 5-5 1.5zM18.5 12l-5 5-1.5-5zM12 18.5l-5-5 5-1.5zM5.5 12l5-5 1.5 5z" fill="currentColor" />
        </svg>
        <span>Lightmill</span>
      </a>
      <nav aria-label="Pages">
        <a href="#/jobs" aria-current={here('jobs')}>
          Jobs <span class="count">{jobs.size}</span>
        </a>
        <a href="#/workers" aria-current={here('workers')}>
          Workers <span class="count">{workers.size}</span>
        </a>
        <a href="#/lab" aria-current={here('lab')}>
          Lab
        </a>
        <a href="docs">Docs</a>
      </nav>
      <span class="spacer" />
      <span class={`link link-${link}`} role="status">
        <span class="dot" aria-hidden="true" />
        {kLinkTexts[link]}
      </span>
      <LogOut />
      <button type="button" class="quiet" aria-label={`Theme: ${theme}. Press to change.`} title={`Theme: ${theme}`} onClick={onTheme}>
        {{auto: '◐', light: '☀', dark: '☾'}[theme]}
      </button>
    </header>
  );
}

function NowherePage({path}: {path: string}) {
  return (
    <section class="page">
      <h1>Page not found</h1>
      <p class="notice">
        There is no page “{path}”. Go to <a href="#/jobs">jobs</a>, <a href="#/workers">workers</a> or <a href="#/lab">lab</a>.
      </p>
    </section>
  );
}

export function App() {
  const route = useRoute();
  const [theme, resolved, nextTheme] = useTheme();
  const {link, greeting} = useFarm();
  useWatch(route.page === 'job' ? route.job : 0n);
  useEffect(() => {
    document.title = route.page === 'job' ? `Job ${route.job} · Lightmill` : {workers: 'Workers · Lightmill', lab: 'Lab · Lightmill', jobs: 'Lightmill', nowhere: 'Lightmill'}[route.page];
  }, [route]);
  return (
    <>
      <a class="skip" href="#main" onClick={(event) => (event.preventDefault(), document.getElementById('main')?.focus())}>
        Skip to content
      </a>
      <Header route={route} theme={theme} onTheme={nextTheme} />
      {link === 'lost' && (
        <p class="notice lost" role="alert">
          The connection to the coordinator is lost. The page shows the last known state. Retrying…{' '}
          <button type="button" onClick={() => farm.connectNow()}>
            Now
          </button>
        </p>
      )}
      {greeting?.notices.map((notice) => (
        <p class="notice" key={notice}>
          {notice}
        </p>
      ))}
      <main id="main" tabIndex={-1}>
        {link === 'closed' && <LoginPage />}
        {link !== 'closed' && route.page === 'jobs' && <JobsPage />}
        {link !== 'closed' && route.page === 'nowhere' && <NowherePage path={route.path} />}
        {link !== 'closed' && route.page === 'workers' && <WorkersPage theme={resolved} />}
        {link !== 'closed' && route.page === 'lab' && <LabPage theme={resolved} />}
        {link !== 'closed' && route.page === 'job' && <JobPage key={String(route.job)} id={route.job} linked={route} theme={resolved} />}
      </main>
    </>
  );
}
