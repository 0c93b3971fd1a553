// Closes the hint before this image for good when its button is clicked; KEY: in localStorage.
const hint = this.previousElementSibling;
const hide = () => { hint.style.display = 'none'; };
hint.querySelector('button').onclick = () => { localStorage[KEY] = 'closed'; hide(); };
if (localStorage[KEY]) hide();
