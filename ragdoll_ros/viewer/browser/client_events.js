// Sends the events of a listener as values of a hidden text field of viser, with a running number
// that no other page has, because viser drops a value that equals the last one. After a restart of
// the server the same listener runs under the new ids.
// NAME: of the listener; FIELD, WIDGET: viser's ids of the hidden field and of the observed widget.
// `listen(send, isTyped)` is the listener, a function of another file of this folder.
const listeners = window.ragdollListeners ??= {};
const isNew = !(NAME in listeners);
listeners[NAME] = {field: FIELD, widget: WIDGET};
if (isNew) {
  let count = Date.now();
  const send = (text) => window.__viserMutable.sendMessage({
    type: 'GuiUpdateMessage', uuid: listeners[NAME].field, updates: {value: `${count++} ${text}`}});
  const isTyped = (input) => input.matches('input:not([type=hidden])')
    && document.querySelector(`label[for='${listeners[NAME].widget}']`)
      ?.closest('.mantine-Flex-root').contains(input);
  listen(send, isTyped);
}
