// The theme that was chosen on the page, else the system's.
const dark = matchMedia('(prefers-color-scheme: dark)');
const show = () => {
  const chosen = localStorage.getItem('theme');
  document.documentElement.dataset.theme = chosen === 'light' || chosen === 'dark' ? chosen : dark.matches ? 'dark' : 'light';
};
dark.addEventListener('change', show);
show();
