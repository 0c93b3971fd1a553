// Sends the id of the text field in which Enter is pressed, and before it the field's text, as when
// the field loses the focus: viser holds typed text back for up to 50 ms, and drops it if something
// else is changed by then.
function listen(send) {
  const idOf = (input) => input.matches('.mantine-TextInput-input, .mantine-ColorInput-input')
    && input.closest('.mantine-Flex-root')?.querySelector('label')?.htmlFor;
  const sendText = (input) => {
    if (input.matches('.mantine-TextInput-input')) window.__viserMutable.sendMessage({
      type: 'GuiUpdateMessage', uuid: idOf(input), updates: {value: input.value}});
  };
  document.addEventListener('focusout', ({target}) => idOf(target) && sendText(target));
  document.addEventListener('keydown', (event) => {
    if (event.key !== 'Enter' || event.isComposing || !idOf(event.target)) return;
    sendText(event.target);
    send(idOf(event.target));
  });
}
