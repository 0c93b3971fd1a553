// Gives names to what viser leaves without one for screen readers: sliders and their fields, from
// the label in the same line, fields whose label names nothing, and buttons that are an icon. The
// headings of folders, which only a click opens, become buttons. Marks landmarks and the title.
if (!window.ragdollNames) {
  const icons = {'list-search': 'Commands', adjustments: 'Settings and diagnostics of the page',
                 'arrow-back': 'Back to the controls', share: 'Share'};
  const set = (node, name, value) => {
    if (node && node.getAttribute(name) !== value) node.setAttribute(name, value);
  };
  const nameFields = () => {
    for (const label of document.querySelectorAll('label[for]')) {
      const line = label.closest('.mantine-Flex-root');
      for (const field of line?.querySelectorAll('[role=slider], input:not([type=hidden])') ?? [])
        if (field.id !== label.htmlFor) set(field, 'aria-label', label.textContent);
    }
  };
  const nameIcons = () => {
    for (const button of document.querySelectorAll('button:not([aria-label])')) {
      if (button.textContent.trim()) continue;
      const icon = Object.keys(icons).find((each) => button.querySelector(`.tabler-icon-${each}`));
      if (icon) set(button, 'aria-label', icons[icon]);
    }
  };
  const makeFoldersButtons = () => {
    for (const icon of document.querySelectorAll(
        '.tabler-icon-chevron-up, .tabler-icon-chevron-down')) {
      const heading = icon.parentElement;
      if (!heading.classList.contains('mantine-Paper-root')) continue;
      set(heading, 'data-ragdoll-folder', '');
      set(heading, 'role', 'button');
      set(heading, 'tabindex', '0');
      set(heading, 'aria-expanded', String(icon.classList.contains('tabler-icon-chevron-up')));
    }
  };
  const markLandmarks = () => {
    const canvas = window.__viserMutable?.canvas;
    set(canvas, 'role', 'img');
    set(canvas, 'aria-label', 'The dolls');
    set(canvas?.parentElement.parentElement.parentElement, 'role', 'main');
    for (const each of document.querySelectorAll('canvas:not([role])')) {
      const title = each.closest('.uplot')?.querySelector('.u-title');
      set(each, 'role', title ? 'img' : 'none');
      if (title) set(each, 'aria-label', `Plot: ${title.textContent}`);
    }
    const state = document.querySelector('.tabler-icon-cloud-check');
    set(state?.nextElementSibling, 'role', 'heading');
    set(state?.nextElementSibling, 'aria-level', '1');
    let panel = state;
    while (panel && !panel.querySelector('[role=tablist]')) panel = panel.parentElement;
    set(panel, 'role', 'region');
    set(panel, 'aria-label', 'Controls');
  };
  window.ragdollNames = setInterval(() => {
    nameFields();
    nameIcons();
    makeFoldersButtons();
    markLandmarks();
  }, 500);
  document.addEventListener('keydown', (event) => {
    if (!event.target.matches?.('[data-ragdoll-folder]')) return;
    if (event.key !== 'Enter' && event.key !== ' ') return;
    event.preventDefault();
    event.stopPropagation();
    event.target.click();
  }, true);
}
