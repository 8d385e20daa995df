// Lines that are wider than a pixel.
import {LineMaterial} from './three/examples/jsm/lines/LineMaterial.js';
import {LineSegments2} from './three/examples/jsm/lines/LineSegments2.js';
import {LineSegmentsGeometry} from './three/examples/jsm/lines/LineSegmentsGeometry.js';

/** Lines between pairs of points, with a constant width on the screen; the points may change. */
export class WideLine {
  constructor(settings) {
    this.material = new LineMaterial(settings);
    this.material.uniforms.opacity.value = settings.opacity ?? 1;
    this.object = new LineSegments2(undefined, this.material);
    this.object.frustumCulled = false;
    this.object.visible = false;
    this.shown = true;
  }

  /** `colors`: red, green, blue (0 to 1) of each point, for a material with vertexColors. */
  set(positions, colors = null) {
    const enough = positions.length >= 6;
    this.object.visible = enough && this.shown;
    this.enough = enough;
    if (!enough) return;
    this.object.geometry.dispose();
    this.object.geometry = new LineSegmentsGeometry();
    this.object.geometry.setPositions(positions);
    if (colors) this.object.geometry.setColors(colors);
  }

  show(shown) {
    this.shown = shown;
    this.object.visible = shown && !!this.enough;
  }
}
