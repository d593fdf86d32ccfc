// The WebSocket to the render. It sends commands, receives messages and pictures, and reconnects if
// the connection is lost.

import { unpack } from "./coding.js";

export class Link extends EventTarget {
  #socket = null;
  #attempts = 0;
  #timer = 0;
  bytes = 0;
  frames = 0;
  // The last message that is being unpacked. The next message waits for it, so that messages keep
  // their order.
  #last = Promise.resolve();

  open() {
    clearTimeout(this.#timer);
    const address = new URL("socket", location.href);
    address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(address);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.#attempts = 0;
      this.#tell("open");
    };
    socket.onmessage = ({ data }) => {
      if (typeof data === "string") {
        const message = JSON.parse(data);
        this.#tell(message.type, message);
      } else {
        this.bytes += data.byteLength;
        this.frames += 1;
        const start = performance.now();
        const show = async () => {
          let header = {};
          try {
            header = readHeader(data);
            this.#tell("frame", { ...header, halves: await readHalves(data, header) });
          } catch (error) {
            this.#tell("error", { text: `A picture of the render cannot be shown: ${error.message}\nReload the page. If the error remains, use a newer browser.` });
          }
          // Confirm the picture, because the render limits the number of unconfirmed pictures.
          if (header.frame) this.send({ do: "shown", frame: header.frame, ms: performance.now() - start });
        };
        this.#last = this.#last.then(show);
      }
    };
    socket.onclose = () => {
      if (this.#socket !== socket) return;
      this.#tell("lost");
      // Stop after a few attempts: a restarted program has another link, even on the same port.
      this.#attempts += 1;
      if (this.#attempts <= 5) this.#timer = setTimeout(() => this.open(), 1000 * this.#attempts);
    };
    this.#socket = socket;
  }

  get isOpen() {
    return this.#socket?.readyState === WebSocket.OPEN;
  }

  send(command) {
    // Mark the samples of the shown picture as out of date.
    if (["camera", "set", "material", "light", "reset-changes", "compare"].includes(command.do)) document.documentElement.dataset.samples = "waiting";
    if (this.isOpen) this.#socket.send(JSON.stringify(command));
  }

  set(key, value) {
    this.send({ do: "set", key, value });
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}

const headerLength = (buffer) => new DataView(buffer).getUint32(0, true);

// Reads the header of a picture.
function readHeader(buffer) {
  return JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, headerLength(buffer))));
}

// Bits of the picture's 16-bit floats.
async function readHalves(buffer, { packed, width }) {
  const rest = buffer.slice(4 + headerLength(buffer));
  return packed ? await unpack(rest, width, packed) : new Uint16Array(rest);
}
