// Viewer of panoramas. An image `panorama-*.png` of a page, or an image of the class `panorama`,
// becomes a canvas that shows a perspective of the panorama. It turns slowly until it is dragged,
// also by touch, or turned by the arrow keys. It does not turn if the reader prefers reduced
// motion, or while it is out of sight. Without JavaScript or WebGL 2 the page shows the image. Each
// pixel of the canvas is a ray, whose longitude and latitude are the place in the image. The image
// has the same layout as `--projection panorama`.
const VERTICES = `
attribute vec2 corner; varying vec2 place;
void main() { place = corner; gl_Position = vec4(corner, 0.0, 1.0); }`;
const PIXELS = `
precision highp float;
uniform sampler2D image; uniform vec2 angles; uniform vec2 half_size; varying vec2 place;
void main() {
  vec3 ray = vec3(place * half_size, 1.0);
  float c = cos(angles.y), s = sin(angles.y);
  ray = normalize(vec3(ray.x, c * ray.y + s * ray.z, c * ray.z - s * ray.y));
  float longitude = atan(ray.x, ray.z) + angles.x, latitude = asin(clamp(ray.y, -1.0, 1.0));
  gl_FragColor = texture2D(image, vec2(longitude / 6.2831853 + 0.5, 0.5 - latitude / 3.1415927));
}`;

function showPanorama(image) {
  const canvas = document.createElement("canvas");
  const gl = canvas.getContext("webgl2");
  if (!gl) return;
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, VERTICES], [gl.FRAGMENT_SHADER, PIXELS]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return;
  gl.useProgram(program);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), gl.STATIC_DRAW);
  const corner = gl.getAttribLocation(program, "corner");
  gl.enableVertexAttribArray(corner);
  gl.vertexAttribPointer(corner, 2, gl.FLOAT, false, 0, 0);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  try {
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, gl.RGB, gl.UNSIGNED_BYTE, image);
  } catch {
    return; // Browsers refuse images of pages that were opened as files.
  }
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);

  // Azimuth and elevation of the view axis, in radians. The picture is 80 degrees high.
  let yaw = 0, pitch = 0, last = 0, pending = false, visible = false;
  let turning = !matchMedia("(prefers-reduced-motion: reduce)").matches;
  const half = Math.tan((40 * Math.PI) / 180);
  const draw = (now) => {
    pending = false;
    if (turning && last) yaw += Math.min(now - last, 100) * 1e-4;
    last = now;
    canvas.width = Math.round(canvas.clientWidth * devicePixelRatio);
    canvas.height = Math.round(canvas.clientHeight * devicePixelRatio);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.uniform2f(gl.getUniformLocation(program, "angles"), yaw, pitch);
    gl.uniform2f(gl.getUniformLocation(program, "half_size"), (half * canvas.width) / canvas.height, half);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    if (turning && visible) request();
  };
  const request = () => {
    if (!pending) requestAnimationFrame(draw);
    pending = true;
  };
  const turn = (right, up) => {
    turning = false;
    yaw += right;
    pitch = Math.max(-1.5, Math.min(1.5, pitch + up));
    request();
  };
  let from = null;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    from = event;
    turn(0, 0);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!canvas.hasPointerCapture(event.pointerId)) return;
    const step = (2 * half) / canvas.clientHeight;
    turn((from.clientX - event.clientX) * step, (event.clientY - from.clientY) * step);
    from = event;
  });
  // Without this, the guide takes a swipe for a command to its sidebar.
  canvas.addEventListener("touchstart", (event) => event.stopPropagation(), { passive: true });
  // Arrow keys also change pages of the guide; here they only turn the view.
  canvas.addEventListener("keydown", (event) => {
    const steps = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
    const step = steps[event.key];
    if (!step) return;
    turn(...step);
    event.preventDefault();
    event.stopPropagation();
  });
  canvas.className = "panorama";
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", `${image.alt}. Drag or use the arrow keys to look around.`);
  image.replaceWith(canvas);
  new ResizeObserver(request).observe(canvas);
  new IntersectionObserver(([entry]) => {
    visible = entry.isIntersecting;
    last = 0;
    request();
  }).observe(canvas);
}

for (const image of document.querySelectorAll('img[src*="/panorama-"], img.panorama')) {
  image.decode().then(() => showPanorama(image), () => {});
}
