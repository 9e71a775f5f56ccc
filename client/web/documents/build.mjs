// Writes the documents as pages of the coordinator: README.md is /docs, docs/guide/render.md is /docs/guide/render.
//   node documents/build.mjs SOURCE-FOLDER PAGE-FOLDER
import {cpSync, mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {dirname, join, posix} from 'node:path';
import {fileURLToPath} from 'node:url';
import {gzipSync} from 'node:zlib';
import {Marked} from 'marked';

const [source, out] = process.argv.slice(2);
const kHere = fileURLToPath(new URL('.', import.meta.url));
/** Folders of pages, in the order of the table of contents. */
const kFolders = {
  docs: 'Overview',
  'docs/guide': 'Guide',
  'docs/operate': 'Operate',
  'docs/reference': 'Reference',
  'docs/design': 'Design',
  'docs/evidence': 'Evidence',
};

const inDocs = readdirSync(join(source, 'docs'), {recursive: true}).map((name) => `docs/${name}`);
const pictures = inDocs.filter((name) => /\.(png|svg)$/.test(name));
const texts = ['README.md', ...inDocs.filter((name) => name.endsWith('.md')).sort(), 'ARCHITECTURE.md', 'CONTRIBUTING.md'];
const documents = texts.map((file) => {
  const text = readFileSync(join(source, file), 'utf8');
  const page = pageOf(file);
  return {file, text, page, folder: page === 'docs' ? 'docs' : dirname(page), title: /^# (.+)$/m.exec(text)[1].replaceAll('`', '')};
});
const pages = new Map(documents.map(({file, page}) => [file, page]));

/** The address of a document below the coordinator's, without a leading slash. */
function pageOf(file) {
  return file === 'README.md' ? 'docs' : file.replace(/^(docs\/)?/, 'docs/').replace(/\.md$/, '');
}

function escaped(text) {
  return text.replace(/[&<>"]/g, (each) => ({'&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;'})[each]);
}

/** The address of `to` as a link on the page `from`. */
function link(from, to) {
  return posix.join(posix.relative(dirname(`/${from}`), dirname(`/${to}`)), posix.basename(to));
}

/** The address of a document's link on its page; undefined if it leads to a file that is no page. */
function target(document, href) {
  if (/^[a-z]+:|^#/.test(href)) {
    return href;
  }
  const [path, anchor] = href.split('#');
  const file = posix.join(dirname(document.file), path);
  const there = pages.get(file) ?? (pictures.includes(file) ? file : undefined);
  return there && link(document.page, there) + (anchor ? `#${anchor}` : '');
}

/** The document's text as HTML. Its headings have GitHub's anchors. */
function article(document) {
  const seen = new Map();
  const anchor = (title) => {
    const name = title.toLowerCase().replace(/[^\p{L}\p{N}_\- ]/gu, '').replaceAll(' ', '-');
    const count = seen.get(name) ?? 0;
    seen.set(name, count + 1);
    return count ? `${name}-${count}` : name;
  };
  const renderer = {
    heading({tokens, depth, text}) {
      return `<h${depth} id="${anchor(text)}">${this.parser.parseInline(tokens)}</h${depth}>\n`;
    },
    link({href, tokens}) {
      const address = target(document, href);
      const text = this.parser.parseInline(tokens);
      return address ? `<a href="${escaped(address)}">${text}</a>` : text;
    },
    image({href, text}) {
      return `<img src="${escaped(target(document, href))}" alt="${escaped(text)}" loading="lazy">`;
    },
  };
  return new Marked({renderer})
    .parse(document.text)
    .replaceAll('<table>', '<div class="scroll" tabindex="0"><table>')
    .replaceAll('</table>', '</table></div>')
    .replaceAll('<pre>', '<pre tabindex="0">');
}

function contents(page) {
  const current = (each) => (each.page === page ? ' aria-current="page"' : '');
  const entry = (each) => `<a href="${link(page, each.page)}"${current(each)}>${escaped(each.title)}</a>`;
  const group = ([folder, title]) => [`<h2>${title}</h2>`, ...documents.filter((each) => each.folder === folder).map(entry)];
  return Object.entries(kFolders).flatMap(group).join('\n');
}

const style = /assets\/[^"]+\.css/.exec(readFileSync(join(out, 'index.html'), 'utf8'))[0];

function html(document) {
  const to = (path) => link(document.page, path);
  return `<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>${escaped(document.title)} · Lightmill</title>
<link rel="icon" type="image/svg+xml" href="${to('icon.svg')}">
<link rel="stylesheet" href="${to(style)}">
<link rel="stylesheet" href="${to('docs/style.css')}">
<script src="${to('docs/theme.js')}"></script>
</head>
<body>
<a class="skip" href="#main">Skip to content</a>
<header class="top">
<a class="brand" aria-label="Lightmill, all jobs" href="${to('')}#/jobs"><img src="${to('icon.svg')}" width="22" height="22" alt=""><span>Lightmill</span></a>
<nav aria-label="Pages"><a href="${to('docs')}" aria-current="true">Docs</a><a class="to-contents" href="#contents">Contents</a></nav>
</header>
<div class="documents">
<nav id="contents" class="contents" aria-label="Documents">
${contents(document.page)}
</nav>
<main id="main" class="document" tabindex="-1">
${article(document)}</main>
</div>
</body>
</html>
`;
}

function write(path, text) {
  mkdirSync(dirname(join(out, path)), {recursive: true});
  writeFileSync(join(out, path), text);
  writeFileSync(join(out, `${path}.gz`), gzipSync(text, {level: 9}));
}

rmSync(join(out, 'docs'), {recursive: true, force: true});
for (const picture of pictures) {
  cpSync(join(source, picture), join(out, picture));
}
for (const file of ['style.css', 'theme.js']) {
  write(`docs/${file}`, readFileSync(join(kHere, file)));
}
for (const document of documents) {
  write(`${document.page}.html`, html(document));
}
