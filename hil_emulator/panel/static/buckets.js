// The buckets on the screen: least and greatest values of every shown signal, in constant memory.

export class Buckets {
  constructor(names) {
    this.names = names;
    this.clear();
  }

  clear() {
    this.length = 0;
    this.room = 0;
    this.begin = 0;
    this.width = 1;
  }

  // Takes a message; a live one may repeat the last bucket, and pushes out what leaves the span.
  take(message, span) {
    const { columns, count, begin, width } = message;
    if (columns !== this.names.length || !count) return;
    if (!message.live || width !== this.width || !this.length) this.start(message, span);
    const at = Math.round((begin - this.begin) / width);
    const most = Math.ceil(span / width) + 2;
    let to = at;
    if (at < 0 || at > this.length) { this.start(message, span); to = 0; }
    if (to + count > this.room) to -= this.drop(Math.max(to + count - this.room, this.length - most));
    for (let c = 0; c < columns; c++) {
      this.low[c].set(message.low.subarray(c * count, (c + 1) * count), to);
      this.high[c].set(message.high.subarray(c * count, (c + 1) * count), to);
    }
    this.length = to + count;
  }

  start({ begin, width, count, live }, span) {
    this.begin = begin;
    this.width = width;
    this.length = 0;
    this.room = live ? 2 * Math.ceil(span / width) + count + 8 : count;
    this.low = this.names.map(() => new Float32Array(this.room));
    this.high = this.names.map(() => new Float32Array(this.room));
  }

  drop(many) {
    for (const values of [...this.low, ...this.high]) values.copyWithin(0, many, this.length);
    this.begin += many * this.width;
    this.length -= many;
    return many;
  }

  // Returns x and, per signal, y for lines through every least and greatest value from a time on.
  lines(from, scales) {
    let first = Math.max(0, Math.floor((from - this.begin) / this.width));
    while (first < this.length && this.low.every((values) => Number.isNaN(values[first]))) first++;
    const count = Math.max(0, this.length - first);
    const x = new Float64Array(2 * count);
    for (let i = 0; i < count; i++) {
      x[2 * i] = this.begin + (first + i + 0.25) * this.width;
      x[2 * i + 1] = this.begin + (first + i + 0.75) * this.width;
    }
    const ys = this.names.map((_, c) => {
      const y = new Float64Array(2 * count);
      const low = this.low[c], high = this.high[c], scale = 1 / scales[c];
      for (let i = 0; i < count; i++) {
        // the nearer end first, so that a slope stays one line
        const a = low[first + i] * scale, b = high[first + i] * scale;
        const rising = i > 0 && Math.abs(y[2 * i - 1] - a) > Math.abs(y[2 * i - 1] - b);
        y[2 * i] = rising ? b : a;
        y[2 * i + 1] = rising ? a : b;
      }
      return y.some(Number.isNaN) ? Array.from(y, (value) => (Number.isNaN(value) ? null : value)) : y;
    });
    return [x, ys];
  }
}
