// The page's end of the WebSocket: converts messages to objects; binary data become typed arrays.

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

export class Connection {
  /** `handlers`: message(object), opened(), closed(). After a lost connection it connects again and
   * receives all messages again. */
  constructor(handlers) {
    this.handlers = handlers;
    this.open();
  }

  open() {
    const url = new URL('updates', location.href);
    url.protocol = url.protocol.replace('http', 'ws');
    this.socket = new WebSocket(url);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onopen = () => this.handlers.opened();
    this.socket.onmessage = ({data}) => {
      if (typeof data !== 'string')
        this.handlers.message(parseBinary(data));
      else
        for (const message of JSON.parse(data)) this.handlers.message(message);
    };
    this.socket.onclose = () => {
      this.handlers.closed();
      setTimeout(() => this.open(), 1000);
    };
  }

  /** Asks for a robot's camera images, or ends the request. */
  wantImages(robot, on) {
    if (this.socket.readyState === WebSocket.OPEN)
      this.socket.send(JSON.stringify({images: robot, on}));
  }
}
