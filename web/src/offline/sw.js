// Keeps this build's files, so that the page works offline after the first visit. BUILD and FILES are filled in
// when the page is built. A new build waits until no page of the old one is open: a page that has yet to load a part
// finds the one that it was built with, and no page ever mixes two builds.
const CACHE = `monorange-${'BUILD'}`;
const FILES = ['FILES'];

self.addEventListener('install', (event) => {
  event.waitUntil(caches.open(CACHE).then((cache) => cache.addAll(FILES)));
});

self.addEventListener('activate', (event) => {
  const drop = (names) => names.filter((name) => name.startsWith('monorange-') && name !== CACHE);
  event.waitUntil(
    caches
      .keys()
      .then((names) => Promise.all(drop(names).map((name) => caches.delete(name))))
      .then(() => self.clients.claim()),
  );
});

self.addEventListener('fetch', (event) => {
  const { request } = event;
  if (request.method !== 'GET' || new URL(request.url).origin !== location.origin) return;
  const key = request.mode === 'navigate' ? './' : request;
  event.respondWith(
    caches.open(CACHE).then(async (cache) => (await cache.match(key, { ignoreSearch: true, ignoreVary: true })) ?? fetch(request)),
  );
});
