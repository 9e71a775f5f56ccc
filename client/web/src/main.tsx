/** The entry point of the page. */
import {render} from 'preact';
import {App} from './view/app';
import './view/style/index.css';

render(<App />, document.getElementById('app')!);
