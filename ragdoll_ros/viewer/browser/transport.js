// Builds the transport bar and sends what is done with it: a word, and a number if it needs one.
// The server calls ragdollShow with what has changed, as a panel that is closed shows nothing new,
// and ragdollNotice with a message. STYLE: text of transport.css, which must outlast the panel, too.
// Keys , and . step; viser has no hotkeys for them.
function listen(send) {
  const icon = (path) => `<svg class="icon" viewBox="0 0 24 24" aria-hidden="true">
    <path d="${path}"/></svg>`;
  const PLAY = icon('M7 4v16l13-8z'), PAUSE = icon('M6 5h4v14H6zM14 5h4v14h-4z');
  const SPEEDS = [0.02, 0.05, 0.1, 0.25, 0.5, 1, 2];
  document.head.append(Object.assign(document.createElement('style'), {textContent: STYLE}));
  const bar = document.createElement('div');
  bar.className = 'ragdoll-bar';
  bar.setAttribute('role', 'group');
  bar.setAttribute('aria-label', 'Transport');
  bar.innerHTML = `
    <div class="icons">
      <button data-do="reset" aria-label="Reset" title="Reset to the start (R)">
        ${icon('M12 5V1L6 6.5l6 5.5V8a5.5 5.5 0 1 1-5.5 5.5h-3A8.5 8.5 0 1 0 12 5z')}</button>
      <button data-do="back" aria-label="Step back" title="Previous frame (,)">
        ${icon('M19 5v14L8 12zM5 5h2.5v14H5z')}</button>
      <button data-do="toggle"></button>
      <button data-do="step" aria-label="Step" title="Next tick (. or N), while paused">
        ${icon('M5 5v14l11-7zM16.5 5H19v14h-2.5z')}</button>
    </div>
    <label class="time"><input inputmode="decimal" autocomplete="off" aria-label="Time"
      title="simulated time: type one to look back"> s
      <span class="note" role="status" hidden></span></label>
    <select aria-label="Speed" title="simulated time per wall time"></select>
    <i class="break"></i>
    <div class="track"><span></span><input type="range" min="0" step="0.001" aria-label="Timeline"
      title="drag to look back: red, pushes; yellow, contacts; grey, a reset"></div>
    <span class="badge" hidden></span>
    <button class="live" data-do="live" title="Show the newest state (L)">Live</button>
    <span class="notice" role="status" hidden></span>`;
  document.body.append(bar);
  const find = (selector) => bar.querySelector(selector);
  const toggle = find('[data-do=toggle]'), step = find('[data-do=step]');
  const reset = find('[data-do=reset]'), time = find('.time input'), speed = find('select');
  const range = find('[type=range]'), strip = find('.track span'), live = find('.live');
  const badge = find('.badge'), notice = find('.notice'), note = find('.note');
  let byPointer = false, hiding = null, received = 0, last = '', loading = '', looks = 0;

  const put = (element, key, value) => { if (element[key] !== value) element[key] = value; };
  // The server tells the time twice a second; between, it goes on here.
  const showTime = () => {
    const state = window.ragdollTransport;
    const elapsed = state.playing ? Math.min((performance.now() - received) / 1000, 1) : 0;
    const passed = elapsed * state.rate;
    const duration = state.duration + (state.live && !state.recorded ? passed : 0);
    const now = (state.time + passed).toFixed(2);
    if (document.activeElement !== time) put(time, 'value', now);
    if (range.matches(':active')) return;
    put(range, 'max', String(duration));
    put(range, 'value', String(Math.min(state.position + passed, duration)));
    range.setAttribute('aria-valuetext', `${now} s`);
  };
  window.ragdollShow = (state) => {
    if (state.speed === undefined) return;  // the rest was lost and is asked for below
    const name = state.playing ? 'Pause' : 'Play';
    if (toggle.ariaLabel !== name) {
      toggle.ariaLabel = name;
      toggle.title = `${name} (Space)`;
      toggle.innerHTML = state.playing ? PAUSE : PLAY;
    }
    put(step, 'disabled', state.playing && state.live && !state.recorded);
    reset.classList.toggle('resting', state.resting);
    put(reset, 'title', state.resting ? 'At rest: begin again (R)' : 'Reset to the start (R)');
    const stamp = `${state.time} ${state.position}`;
    if (stamp !== last) [last, received] = [stamp, performance.now()];
    showTime();
    if (strip.ragdoll !== state.strip) strip.innerHTML = strip.ragdoll = state.strip;
    const speeds = SPEEDS.includes(state.speed) ? SPEEDS
      : [...SPEEDS, state.speed].sort((a, b) => a - b);
    if (speed.length !== speeds.length || ![...speed].some((x) => +x.value === state.speed))
      speed.replaceChildren(...speeds.map((x) => new Option(`${+x.toPrecision(3)}×`, x)));
    put(speed, 'value', String(state.speed));
    bar.classList.toggle('loading', !!state.loading);
    if (state.loading !== loading) {
      loading = state.loading;
      put(notice, 'hidden', !loading);
      if (loading) put(notice, 'textContent', `Loading ${loading} …`);
    }
    put(live, 'hidden', state.recorded);
    live.setAttribute('aria-pressed', state.live);
    put(badge, 'hidden', state.live && !state.recorded);
    put(badge, 'textContent', state.recorded ? 'Recording' : 'Looking back');
  };
  window.ragdollNotice = (text) => {
    notice.textContent = text;
    notice.hidden = false;
    clearTimeout(hiding);
    hiding = setTimeout(() => { notice.hidden = true; }, 4000);
  };
  window.ragdollTimeNote = (text) => {
    note.textContent = text;
    note.hidden = !text;
    time.setAttribute('aria-invalid', !!text);
  };
  if (window.ragdollTransport) window.ragdollShow(window.ragdollTransport);
  setInterval(() => {
    if (window.ragdollTransport?.speed !== undefined) showTime();
    else if (looks++ % 40 === 0) send('repeat');  // what came before this script may be lost
  }, 50);

  bar.addEventListener('pointerdown', () => { byPointer = true; });
  bar.addEventListener('click', (event) => {
    const button = event.target.closest('[data-do]');
    if (button) send(button.dataset.do);
  });
  time.addEventListener('focus', () => { send('focus'); time.select(); });
  time.addEventListener('blur', () => { send('blur'); window.ragdollTimeNote(''); });
  time.addEventListener('input', () => {
    if (time.value.trim()) send(`time ${time.value}`);
    else window.ragdollTimeNote('');
  });
  range.addEventListener('input', () => send(`position ${range.value}`));
  speed.addEventListener('change', () => send(`speed ${speed.value}`));
  for (const element of [range, speed])
    element.addEventListener('change', () => { if (byPointer) element.blur(); });
  bar.addEventListener('keydown', (event) => {
    byPointer = false;
    // Else Space would press a button and be the hotkey, too.
    if (event.target.matches('button') && ' Enter'.includes(event.key)) event.stopPropagation();
    if (event.target === time && event.key === 'Enter') time.blur();
    const arrows = {ArrowLeft: 'back', ArrowDown: 'back', ArrowRight: 'step', ArrowUp: 'step'};
    if (event.target === range && event.key in arrows) {
      event.preventDefault();
      send(arrows[event.key]);
    }
  });
  document.addEventListener('keydown', (event) => {
    const word = {',': 'back', '.': 'step'}[event.key];
    if (word && !event.ctrlKey && !event.altKey && !event.metaKey
        && !event.target.matches('input:not([type=range]), textarea, [contenteditable]'))
      send(word);
  });
  new ResizeObserver(() => document.documentElement.style.setProperty(
    '--ragdoll-bar', `${bar.offsetHeight}px`)).observe(bar);
}
