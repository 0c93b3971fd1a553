// Sends the text of a colour field when it loses the focus, after '-' or, if the browser knows the
// colour, #rrggbb: a canvas keeps its colour when given an unknown one. Captured before viser, which
// replaces the text.
function listen(send, isTyped) {
  document.addEventListener('focusout', (event) => {
    if (!isTyped(event.target)) return;
    const brush = document.createElement('canvas').getContext('2d');
    brush.fillStyle = 'rgba(0, 0, 0, 0.5)';
    brush.fillStyle = event.target.value;
    const isColor = brush.fillStyle.startsWith('#');
    send(`${isColor ? brush.fillStyle : '-'} ${event.target.value}`);
  }, true);
}
