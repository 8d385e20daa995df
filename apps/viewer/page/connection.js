// Receives the viewer's messages and converts them to objects; binary data become typed arrays.

// Layout: see page_message.hpp.
function parseBinary(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const message = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const begin = 4 + length;
  message.bytes = buffer.byteLength;
  if (message.kind === 'mesh') {
    const faces = begin + 6 * message.vertices, tints = faces + 6 * message.faces;
    const labels = tints + (message.coloured ? 2 * message.vertices : 0);
    message.positions = new Uint16Array(buffer, begin, 3 * message.vertices);
    message.triangles = new Uint16Array(buffer, faces, 3 * message.faces);
    if (message.coloured) message.tints = new Uint16Array(buffer, tints, message.vertices);
    if (message.labelled) message.labels = new Uint8Array(buffer, labels, message.vertices);
  } else if (message.kind === 'raster') {
    message.runs = new Uint8Array(buffer, begin);
  } else {
    const jpeg = begin + 8 * message.features;
    message.pixels = new Float32Array(buffer, begin, 2 * message.features);
    message.jpeg = new Uint8Array(buffer, jpeg);
  }
  return message;
}

// Yields the frames of a stream, see page_server.cpp: texts, and ArrayBuffers of binary data.
async function* framesOf(reader) {
  let chunk = new Uint8Array();
  const read = async (size) => {
    const bytes = new Uint8Array(size);
    for (let filled = 0; filled < size;) {
      if (chunk.length === 0) ({value: chunk = null} = await reader.read());
      if (chunk === null) throw new Error('the viewer has ended');
      const part = chunk.subarray(0, size - filled);
      bytes.set(part, filled);
      filled += part.length;
      chunk = chunk.subarray(part.length);
    }
    return bytes;
  };
  for (;;) {
    const head = new DataView((await read(4)).buffer).getUint32(0, true);
    const bytes = await read(head >>> 1);
    if (head > 0) yield head & 1 ? bytes.buffer : new TextDecoder().decode(bytes);
  }
}

export class Connection {
  /** `handlers`: message(object), opened(), closed(). After a lost connection it connects again and
   * receives all messages again. */
  constructor(handlers) {
    this.handlers = handlers;
    this.asked = Promise.resolve();
    this.open();
  }

  async open() {
    this.page = Math.random().toString(36).slice(2);
    try {
      const {body, ok} = await this.ask('updates', '');
      if (!ok) throw new Error('too many pages');
      this.handlers.opened();
      for await (const frame of framesOf(body.getReader())) this.receive(frame);
    } catch {
      this.handlers.closed();
      setTimeout(() => this.open(), 1000);
    }
  }

  receive(frame) {
    try {
      const messages = typeof frame === 'string' ? JSON.parse(frame) : [parseBinary(frame)];
      for (const message of messages) this.handlers.message(message);
    } catch (error) {
      reportError(error);  // the connection is not the cause
    }
  }

  ask(what, more) {
    return fetch(`${what}?page=${this.page}${more}`, {method: 'POST'});
  }

  /** Asks for a robot's camera images, or ends the request. */
  wantImages(robot, on) {
    const ask = () => this.ask('images', `&robot=${robot}&on=${on}`);
    this.asked = this.asked.then(ask).catch(() => {});
  }
}
