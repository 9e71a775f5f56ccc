/** Where the page begins. */
import {render} from 'preact';
import {App} from './view/app';
import './view/style/index.css';

render(<App />, document.getElementById('app')!);
