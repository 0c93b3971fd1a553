// E opens the tab 'Edit' and sends 'edit'. Where that tab is open already and the scene is edited, W,
// E and R send what handles are to do: 'move', 'turn', 'size'; elsewhere W and R keep their meaning.
// The key that is handled here reaches nothing else: W would move the camera, R reset the scene.
function listen(send) {
  window.ragdollSendEdit = send;
  const open = (tab) => {
    // Viser's docked tabs hear of keys, those of a narrow screen of clicks.
    tab.dispatchEvent(new KeyboardEvent('keydown', {key: 'Enter', bubbles: true}));
    tab.click();
    // The next Tab leads into the tab; no key is for the tab itself.
    tab.focus({preventScroll: true});
    tab.blur();
  };
  document.documentElement.addEventListener('keydown', (event) => {
    const key = event.key.toLowerCase();
    if (!'wer'.includes(key) || event.ctrlKey || event.altKey || event.metaKey
        || event.target.matches('input, textarea, select, [contenteditable]')) return;
    const tab = [...document.querySelectorAll('[role=tab]')]
      .find((each) => each.textContent.trim() === 'Edit');
    const isOpen = tab?.getAttribute('aria-selected') !== 'false';
    const isEditing = isOpen && document.querySelector('.ragdoll-edit-banner');
    if (key !== 'e' && !isEditing) return;
    event.stopImmediatePropagation();
    if (event.repeat) return;
    if (!isOpen) open(tab);
    send(isEditing ? {w: 'move', e: 'turn', r: 'size'}[key] : 'edit');
  }, true);
}
