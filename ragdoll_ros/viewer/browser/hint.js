// Closes the hint before this image for good when its button is clicked; KEY: in localStorage. The
// panel may have been replaced since, as when the viewer comes back.
const hint = this.previousElementSibling, button = hint?.querySelector('button');
const hide = () => { hint.style.display = 'none'; };
if (button) button.onclick = () => { localStorage[KEY] = 'closed'; hide(); };
if (hint && localStorage[KEY]) hide();
