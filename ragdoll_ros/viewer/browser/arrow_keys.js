// Sends which arrow keys are down, every 0.1 s while any is: a page may vanish without a word.
// Arrow keys and E are kept from viser's camera, which would move with them; hotkeys still get E.
// A clicked button or checkbox gives up the focus, or it would take the next Space or arrow key.
// What has the focus by the Tab key keeps the keys that it uses: arrows move a slider and push
// nothing, Space presses a button and does not pause.
function listen(send) {
  const down = new Set();
  const sendAll = () => send([...down].join(' '));
  const release = () => { if (down.size) { down.clear(); sendAll(); } };
  const root = document.documentElement;
  root.addEventListener('keydown', (event) => {
    const key = event.key.replace('Arrow', '').toLowerCase();
    const arrow = event.key.startsWith('Arrow');
    if (arrow || key === 'e') event.stopPropagation();
    if (!arrow || event.target.matches('input, textarea, select, [role=slider], [role=tab]')
        || event.ctrlKey || event.altKey || event.metaKey || down.has(key)) return;
    down.add(key);
    sendAll();
  });
  document.body.addEventListener('keydown', (event) => {
    if ((event.key === ' ' || event.key === 'Enter') && event.target.matches(
        'button, a, summary, [role=button], [role=tab], [role=slider]')) event.stopPropagation();
  });
  root.addEventListener('keyup', (event) => {
    if (down.delete(event.key.replace('Arrow', '').toLowerCase())) sendAll();
  });
  window.addEventListener('blur', release);
  document.addEventListener('visibilitychange', release);
  setInterval(() => { if (down.size) sendAll(); }, 100);
  document.addEventListener('click', (event) => {
    const focused = document.activeElement;
    const isText = focused?.matches('input:not([type=checkbox]), textarea');
    if (event.detail && (!isText || event.target.closest('[role=option]'))) focused?.blur();
  });
}
