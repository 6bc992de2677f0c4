// The line to the panel's process: binary messages of buckets, questions and their answers.

const LIVE = 1;
const HEAD = 48;

export class Stream {
  constructor({ onHello, onBuckets, onWords, onError, onEnd }) {
    this.waiting = new Map();
    this.onError = onError;
    this.count = 0;
    const token = encodeURIComponent(location.hash.slice(1));
    this.socket = new WebSocket(`ws://${location.host}/stream?token=${token}`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = ({ data }) => {
      if (typeof data !== "string") return onBuckets(unpack(data));
      const said = JSON.parse(data);
      if (said.hello) onHello(said.hello);
      else if ("answer" in said) this.answered(said);
      else onWords(said);
    };
    let opened = false;
    this.socket.onopen = () => { opened = true; };
    this.socket.onclose = (event) => onEnd(opened, event.code);
  }

  tell(request) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(request));
  }

  // Returns what is answered; throws what is wrong with the request, in words.
  ask(request) {
    const id = ++this.count;
    this.tell({ ...request, id });
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }

  answered({ answer, ...rest }) {
    const asked = this.waiting.get(answer);
    this.waiting.delete(answer);
    if (!asked) {
      if (rest.error) this.onError(rest.error);
    } else if (rest.error) asked.reject(new Error(rest.error));
    else asked.resolve(rest);
  }
}

// See the page "Protocol" of the documentation for the layout.
function unpack(data) {
  const head = new DataView(data);
  const columns = head.getUint16(2, true), count = head.getUint32(4, true);
  const live = head.getUint16(0, true) === LIVE;
  const numbers = new Float32Array(data, HEAD);
  const size = columns * count;
  const present = numbers.subarray(0, numbers.length - 2 * size);
  return {
    live, columns, count, present,
    generation: head.getUint32(8, true), number: head.getUint32(12, true),
    begin: head.getFloat64(16, true), width: head.getFloat64(24, true), now: head.getFloat64(32, true),
    low: numbers.subarray(present.length, present.length + size),
    high: numbers.subarray(present.length + size),
  };
}
