// Sends when the user starts and stops typing into the number field of a slider.
function listen(send, isTyped) {
  document.addEventListener('focusin', (event) => { if (isTyped(event.target)) send('focus'); });
  document.addEventListener('focusout', (event) => { if (isTyped(event.target)) send('blur'); });
}
