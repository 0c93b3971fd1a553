// Limits the canvas to the area that the sheet of a narrow screen leaves free, so that its centre is
// the centre of what is visible. Viser does so itself for a docked panel.
let sheet = this.parentElement;
while (sheet && getComputedStyle(sheet).position !== 'fixed') sheet = sheet.parentElement;
const view = sheet?.previousElementSibling;
if (view?.querySelector('canvas')) {
  sheet.classList.add('ragdoll-sheet');
  const fit = () => {
    view.style.height = sheet.isConnected ? `calc(100% - ${sheet.offsetHeight}px)` : '100%';
  };
  new ResizeObserver(fit).observe(sheet);
  fit();
}
