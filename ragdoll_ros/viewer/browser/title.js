// The page's name and icon, a doll, in the browser's tab: viser's are its own.
document.title = TITLE;
document.querySelector('link[rel=icon]')?.setAttribute('href', 'data:image/svg+xml,'
  + encodeURIComponent(`<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32">
    <circle cx="16" cy="5.5" r="4.5" fill="#e8b78a"/>
    <rect x="11.5" y="10.5" width="9" height="10" rx="1.5" fill="#1f5c9e"/>
    <g stroke-linecap="round" stroke-width="3.6">
      <path d="M10 12 4 16" stroke="#2b7a3b"/><path d="M22 12l6 4" stroke="#c0392b"/>
      <path d="M13.5 22 12 30" stroke="#2b7a3b"/><path d="M18.5 22l1.5 8" stroke="#c0392b"/>
    </g></svg>`));
