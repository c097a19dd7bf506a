// Asks hzn.wasm: a request is a line of JSON and the contents of a picture file, and the answer is JSON.

const loaded = WebAssembly.instantiateStreaming(fetch("hzn.wasm"), {}).then(({ instance }) => instance.exports);

onmessage = async ({ data: { line, picture } }) => {
  const hzn = await loaded;
  const head = new TextEncoder().encode(line);
  const at = hzn.hzn_request(head.length + picture.length);
  // The memory can move when it grows, so each view is made anew.
  const request = new Uint8Array(hzn.memory.buffer, at, head.length + picture.length);
  request.set(head);
  request.set(picture, head.length);
  const length = hzn.hzn_call();
  const text = new TextDecoder().decode(new Uint8Array(hzn.memory.buffer, hzn.hzn_answer(), length));
  // An error in this line reaches `onerror` of the page, as a trap of the module does.
  postMessage(text);
};

// A rejected promise does not reach `onerror` of the page by itself.
onunhandledrejection = (event) => {
  setTimeout(() => {
    throw event.reason;
  });
};
