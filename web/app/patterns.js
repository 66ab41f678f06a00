// What surfaces have painted on them: pictures drawn once, in code.
import * as THREE from "../vendor/three.module.js";

const BOARDS = 39;
export const DARK = 0.12; // luminance below which the second tone of a sphere is the lighter one

/** @param {THREE.Color} tone */
export const luminance = ({ r, g, b }) => 0.2126 * r + 0.7152 * g + 0.0722 * b;

/** @param {number} width @param {number} height @param {(context: CanvasRenderingContext2D) => void} paint */
function painted(width, height, paint) {
  const canvas = document.createElement("canvas");
  Object.assign(canvas, { width, height });
  paint(canvas.getContext("2d"));
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.anisotropy = 4;
  return texture;
}

/** Numbers from 0 to 1 that are the same each time. */
function seeded() {
  let seed = 7;
  return () => (seed = (seed * 16807) % 2147483647) / 2147483647;
}

/** Two tones in octants, like a mark of the centre of mass, so that a turning sphere is seen to turn. @param {THREE.Color} tone */
export function octants(tone) {
  const hsl = tone.getHSL({});
  const dark = hsl.l < 0.5 && luminance(tone) < DARK;
  const other = dark ? tone.clone().lerp(new THREE.Color("#dce8ff"), 0.3) : tone.clone().multiply(new THREE.Color("#c4bfb9"));
  return painted(512, 256, (context) => {
    for (let column = 0; column < 4; ++column) {
      for (let row = 0; row < 2; ++row) {
        context.fillStyle = `#${((column + row) % 2 ? tone : other).getHexString()}`;
        context.fillRect(column * 128, row * 128, 128, 128);
      }
    }
  });
}

/** Twisted bands in clear glass, like those in a marble. @param {THREE.Color} tone */
export function swirls(tone) {
  const clear = tone.clone().lerp(new THREE.Color("#ffffff"), 0.06);
  const bands = [tone.clone().multiplyScalar(0.62), tone.clone().lerp(new THREE.Color("#ffffff"), 0.55), tone.clone().multiplyScalar(0.76)];
  return painted(512, 256, (context) => {
    const style = (color) => `#${color.getHexString()}`;
    context.fillStyle = style(clear);
    context.fillRect(0, 0, 512, 256);
    context.filter = "blur(2px)";
    bands.forEach((band, at) => {
      context.fillStyle = style(band);
      // Each band goes from pole to pole and turns on its way; what leaves the picture comes back in.
      for (const around of [-512, 0, 512]) {
        const left = (y) => around + 512 * (at / bands.length) + 150 * (y / 256) + 26 * Math.sin(y / 40 + 2 * at);
        const width = (y) => 12 + 50 * Math.sin((Math.PI * y) / 256);
        context.beginPath();
        for (let y = 0; y <= 256; y += 8) context.lineTo(left(y), y);
        for (let y = 256; y >= 0; y -= 8) context.lineTo(left(y) + width(y), y);
        context.fill();
      }
    });
  });
}

/** Boards side by side, each joined of pieces of slightly different tone. */
export function boards() {
  const random = seeded();
  return painted(2048, 16 * BOARDS, (context) => {
    for (let board = 0; board < BOARDS; ++board) {
      const top = 16 * board;
      for (let from = -400 * random(), length = 0; from < 2048; from += length) {
        length = 260 + 420 * random();
        const light = 84 + 13 * random();
        context.fillStyle = `hsl(${34 + 8 * random()} ${30 + 40 * random()}% ${light}%)`;
        context.fillRect(from, top, length, 16);
        for (let streak = 0; streak < 26; ++streak) {
          context.fillStyle = `rgb(96 52 12 / ${2 + 5 * random()}%)`;
          context.fillRect(from + length * random(), top + 16 * random(), 30 + 160 * random(), 0.6 + random());
        }
        context.fillStyle = "rgb(60 32 10 / 30%)";
        context.fillRect(from, top, 1, 16);
      }
      context.fillStyle = "rgb(60 32 10 / 26%)";
      context.fillRect(0, top, 2048, 1);
    }
  });
}

/** The grain of one piece of wood, along x. It goes on where it ends. */
export function grain() {
  const random = seeded();
  const texture = painted(1024, 1024, (context) => {
    context.fillStyle = "hsl(32 34% 92%)";
    context.fillRect(0, 0, 1024, 1024);
    for (let streak = 0; streak < 900; ++streak) {
      const [from, top, length] = [1024 * random(), 1024 * random(), 260 + 700 * random()];
      const [bend, thick] = [3 * (random() - 0.5), 0.7 + 3.2 * random() ** 3];
      context.fillStyle = random() < 0.3 ? `rgb(255 240 214 / ${10 + 14 * random()}%)` : `rgb(86 44 12 / ${3 + 8 * random()}%)`;
      for (const around of [-1024, 0]) {
        context.beginPath();
        context.ellipse(from + around + length / 2, top, length / 2, thick, bend / 400, 0, 2 * Math.PI);
        context.fill();
      }
    }
  });
  texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
  return texture;
}

/** A dim hall with strips of light on its ceiling, as a cube. */
export function hall() {
  const side = (paint) => {
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = 128;
    paint(canvas.getContext("2d"));
    return canvas;
  };
  const wall = side((context) => {
    const shade = context.createLinearGradient(0, 0, 0, 128);
    shade.addColorStop(0, "#6b727b");
    shade.addColorStop(0.5, "#2e3238");
    shade.addColorStop(1, "#1c1a18");
    context.fillStyle = shade;
    context.fillRect(0, 0, 128, 128);
  });
  const ceiling = side((context) => {
    context.fillStyle = "#5b626b";
    context.fillRect(0, 0, 128, 128);
    context.filter = "blur(3px)";
    context.fillStyle = "#ffffff";
    for (const from of [12, 54, 96]) context.fillRect(from, 8, 20, 112);
  });
  const floor = side((context) => {
    context.fillStyle = "#1c1a18";
    context.fillRect(0, 0, 128, 128);
  });
  const cube = new THREE.CubeTexture([wall, wall, ceiling, floor, wall, wall]);
  cube.colorSpace = THREE.SRGBColorSpace;
  cube.needsUpdate = true;
  return cube;
}
