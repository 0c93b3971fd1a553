// Shows over the picture that the scene is being edited, what a drag does (MODE, one of MODES, each
// with its key), and how to run it; removes that where MODE is empty.
document.querySelector('.ragdoll-edit-banner')?.remove();
const view = window.__viserMutable?.canvas?.parentElement;
if (MODE && view) {
  const banner = document.createElement('div');
  banner.className = 'ragdoll-edit-banner';
  banner.setAttribute('role', 'toolbar');
  banner.setAttribute('aria-label', 'Editing');
  banner.append('Editing');
  const add = (label, key, action) => {
    const button = document.createElement('button');
    button.innerHTML = `${label} <kbd>${key}</kbd>`;
    if (action in MODES) button.setAttribute('aria-pressed', action === MODE);
    button.onclick = () => { button.blur(); window.ragdollSendEdit(action); };
    banner.append(button);
  };
  for (const mode in MODES) add(mode[0].toUpperCase() + mode.slice(1), MODES[mode], mode);
  add('Run', 'Space', 'run');
  // What is clicked here is no click on what lies behind.
  for (const type of ['pointerdown', 'pointermove', 'pointerup', 'click'])
    banner.addEventListener(type, (event) => event.stopPropagation());
  view.append(banner);
}
