// Sends 'seen' when the plots come into view, and 'hidden' when they leave it.
window.ragdollPlots = this.parentElement;
function listen(send) {
  let last = null;
  setInterval(() => {
    const isSeen = !document.hidden && window.ragdollPlots.offsetParent;
    const now = isSeen ? window.ragdollPlots : null;
    if (now !== last) send(now ? 'seen' : 'hidden');
    last = now;
  }, 200);
}
