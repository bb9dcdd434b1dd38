// The beat of a heart, in a worker: a page that is not in front may run its own clock once a minute only.

setInterval(() => postMessage(null), 3000);
