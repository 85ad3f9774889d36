"use strict";
// The craft in space: attitude, thrusters, wheels, vectors, funnel, trail. Drawn only when something changed.
const space = (() => {
  const SIZE = 1.5;
  let view = null;

  const vector = (list) => new THREE.Vector3(...list);

  // MRPs s = e tan(theta/4) of the body, as the quaternion that turns the body's axes into the reference frame.
  function turn(s) {
    const n = s[0] * s[0] + s[1] * s[1] + s[2] * s[2];
    return new THREE.Quaternion((2 * s[0]) / (1 + n), (2 * s[1]) / (1 + n), (2 * s[2]) / (1 + n), (1 - n) / (1 + n));
  }

  const at = (columns, i) => columns.map((number) => record.column(number)[i] ?? 0);
  const norm = (list) => Math.hypot(...list);

  function largest(columns, count) {
    let most = 0;
    for (let i = 0; i < count; i++) most = Math.max(most, norm(at(columns, i)));
    return most;
  }

  function rod(colour, length, thick) {
    const group = new THREE.Group();
    const paint = new THREE.MeshLambertMaterial({ color: colour });
    const shaft = new THREE.Mesh(new THREE.CylinderGeometry(thick, thick, 1, 12), paint);
    const head = new THREE.Mesh(new THREE.ConeGeometry(3 * thick, 8 * thick, 16), paint);
    group.add(shaft, head);
    group.userData.stretch = (size) => {
      group.visible = size > 1e-3;
      shaft.scale.y = Math.max(size - 4 * thick, 1e-3);
      shaft.position.y = shaft.scale.y / 2;
      head.position.y = Math.max(size - 4 * thick, 4 * thick);
    };
    group.userData.stretch(length);
    return group;
  }

  const UP = () => new THREE.Vector3(0, 1, 0);

  function point(group, direction) {
    group.quaternion.setFromUnitVectors(UP(), direction);
  }

  function build(home, scheme) {
    const told = scheme.scene;
    const renderer = new THREE.WebGLRenderer({ antialias: true });
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    renderer.setClearColor(new THREE.Color(record.colour("raised")));
    const scene = new THREE.Scene();
    scene.add(new THREE.AmbientLight(0xffffff, 1.6));
    const sun = new THREE.DirectionalLight(0xffffff, 2.2);
    sun.position.set(3, 5, 4);
    scene.add(sun);
    const camera = new THREE.PerspectiveCamera(32, 1, 0.05, 200);
    const count = record.column(scheme.moments[0]).length;
    const names = [];
    const label = (text, object, offset) => {
      const element = document.createElement("span");
      element.className = "name";
      element.textContent = text;
      home.append(element);
      names.push({ element, object, offset });
      return element;
    };
    const colours = ["c0", "c1", "c2"].map((name) => new THREE.Color(record.colour(name)));
    const quiet = new THREE.Color(record.colour("quiet"));

    // The reference frame.
    const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map(vector);
    axes.forEach((axis, i) => {
      const line = rod(quiet, 2.1, 0.008);
      point(line, axis);
      scene.add(line);
      const name = label(`${"xyz"[i]} ref`, scene, axis.clone().multiplyScalar(2.25));
      name.style.color = record.colour("quiet");
    });

    // The craft.
    const craft = new THREE.Group();
    scene.add(craft);
    const far = told.position ? largest(told.position, count) + norm(told.offset) : 0;
    const metres = SIZE / Math.max(...told.size);
    const shrunk = told.position ? 0.35 : 1;
    const body = new THREE.Group();
    body.scale.setScalar(shrunk);
    craft.add(body);
    const box = new THREE.BoxGeometry(...told.size.map((side) => side * metres));
    const hull = new THREE.Mesh(box, new THREE.MeshLambertMaterial({ color: quiet, transparent: true, opacity: 0.55, depthWrite: false }));
    const edges = new THREE.LineSegments(new THREE.EdgesGeometry(box), new THREE.LineBasicMaterial({ color: new THREE.Color(record.colour("ink")) }));
    const turned = new THREE.Group();
    const [a, b, c] = told.turned;
    turned.quaternion.setFromRotationMatrix(new THREE.Matrix4().set(...a, 0, ...b, 0, ...c, 0, 0, 0, 0, 1));
    const middle = told.centre.map((value) => value * metres);
    hull.position.set(...middle);
    edges.position.set(...middle);
    turned.add(hull, edges);
    body.add(turned);
    axes.forEach((axis, i) => {
      const line = rod(colours[i], 1.5, 0.02);
      point(line, axis);
      body.add(line);
      const name = label("xyz"[i], body, axis.clone().multiplyScalar(1.65));
      name.style.color = record.colour(`c${i}`);
    });

    // Thrusters: a plume against the force, as long as the force is large.
    const plumes = [];
    if (told.jets) {
      told.jets.positions.forEach((place, i) => {
        const nozzle = new THREE.Group();
        nozzle.position.set(...place.map((value) => value * metres));
        const knob = new THREE.Mesh(new THREE.SphereGeometry(0.035, 12, 8), new THREE.MeshLambertMaterial({ color: quiet }));
        const plume = new THREE.Mesh(new THREE.ConeGeometry(0.09, 1, 16, 1, true), new THREE.MeshBasicMaterial({ color: colours[1], transparent: true, opacity: 0.75, side: THREE.DoubleSide, depthWrite: false }));
        const turnedPlume = new THREE.Group();
        // The tip of the cone is at the nozzle, its open end where the exhaust goes.
        plume.rotation.x = Math.PI;
        turnedPlume.add(plume);
        point(turnedPlume, vector(told.jets.directions[i]).negate().normalize());
        nozzle.add(knob, turnedPlume);
        body.add(nozzle);
        plumes.push(plume);
      });
    }

    // Wheels: discs about their axes.
    const wheels = [];
    if (told.spinners) {
      const most = Math.max(1e-12, ...told.spinners.a.map((number) => record.column(number).reduce((found, value) => Math.max(found, Math.abs(value ?? 0)), 0)));
      const times = record.column(scheme.moments[0]);
      told.spinners.axes.forEach((axis, i) => {
        const place = new THREE.Group();
        const along = vector(axis).normalize();
        point(place, along);
        place.position.copy(along.clone().multiplyScalar(0.95));
        const disc = new THREE.Group();
        const paint = new THREE.MeshLambertMaterial({ color: quiet });
        disc.add(new THREE.Mesh(new THREE.CylinderGeometry(0.3, 0.3, 0.08, 32), paint));
        const spoke = new THREE.Mesh(new THREE.BoxGeometry(0.56, 0.1, 0.06), new THREE.MeshLambertMaterial({ color: new THREE.Color(record.colour("paper")) }));
        disc.add(spoke);
        place.add(disc);
        body.add(place);
        // The angle is the integral of the speed, slowed so that the fastest wheel turns twenty times in the flight.
        const speeds = record.column(told.spinners.a[i]);
        const angles = new Float64Array(times.length);
        const slow = (40 * Math.PI) / (most * Math.max(1e-9, times[times.length - 1] - times[0]));
        for (let k = 1; k < times.length; k++) angles[k] = angles[k - 1] + slow * 0.5 * ((speeds[k] ?? 0) + (speeds[k - 1] ?? 0)) * (times[k] - times[k - 1]);
        wheels.push({ disc, paint, angles, speeds, most });
        label(String(i + 1), body, along.clone().multiplyScalar(1.15)).style.color = record.colour("quiet");
      });
    }

    // Vectors.
    const arrows = told.arrows.map((one, i) => {
      const colour = `c${3 + (i % 3)}`;
      const arrow = rod(new THREE.Color(record.colour(colour)), 1, 0.03);
      (one.frame === "body" ? craft : scene).add(arrow);
      const name = label(one.label, one.frame === "body" ? craft : scene, new THREE.Vector3());
      name.style.color = record.colour(colour);
      return { ...one, arrow, name: names[names.length - 1], most: largest(one.a, count) };
    });

    // Directions that stay.
    const outside = told.directions.map((one) => {
      const direction = vector(one.vector).normalize();
      const line = rod(new THREE.Color(record.colour("c4")), 1.9, 0.02);
      point(line, direction);
      scene.add(line);
      label(one.label, scene, direction.clone().multiplyScalar(2.05)).style.color = record.colour("c4");
      return { line, direction, name: names[names.length - 1] };
    });

    // The funnel of the attitude: within it the body's x axis stays in a cone about the reference's.
    let cone = null;
    if (told.cone) {
      cone = new THREE.Mesh(new THREE.ConeGeometry(1, 1, 48, 1, true), new THREE.MeshBasicMaterial({ color: colours[0], transparent: true, opacity: 0.16, side: THREE.DoubleSide, depthWrite: false }));
      scene.add(cone);
    }

    // Relative motion.
    let trail = null;
    let passed = null;
    let scale = 1;
    if (told.position) {
      scale = 2.6 / Math.max(far, told.keep_out, 1e-12);
      const lump = new THREE.Mesh(new THREE.BoxGeometry(0.3, 0.3, 0.3), new THREE.MeshLambertMaterial({ color: new THREE.Color(record.colour("c4")) }));
      scene.add(lump);
      label(told.other, scene, new THREE.Vector3(0, -0.3, 0));
      if (told.keep_out > 0) {
        const sphere = new THREE.SphereGeometry(told.keep_out * scale, 40, 24);
        scene.add(new THREE.Mesh(sphere, new THREE.MeshBasicMaterial({ color: new THREE.Color(record.colour("bad")), transparent: true, opacity: 0.14, depthWrite: false })));
        label("keep out", scene, new THREE.Vector3(0, told.keep_out * scale, 0)).style.color = record.colour("bad");
      }
      const places = new Float32Array(3 * count);
      for (let i = 0; i < count; i++) places.set(position(told, i).multiplyScalar(scale).toArray(), 3 * i);
      const line = (colour) => {
        const geometry = new THREE.BufferGeometry();
        geometry.setAttribute("position", new THREE.BufferAttribute(places, 3));
        const made = new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: colour }));
        scene.add(made);
        return made;
      };
      trail = line(quiet);
      passed = line(colours[1]);
    }

    home.append(renderer.domElement);
    return { home, told, scheme, renderer, scene, camera, craft, body, plumes, wheels, arrows, outside, cone, passed, scale, names, look: { around: 0.7, above: 0.45, away: 8.2 }, moment: 0, dirty: true };
  }

  // Where the craft is, reference frame, [m].
  function position(told, i) {
    const place = vector(at(told.position, i));
    if (told.position_frame === "body" && told.attitude) place.applyQuaternion(turn(at(told.attitude, i)));
    return place.add(vector(told.offset));
  }

  function pose() {
    const { told, craft, plumes, wheels, arrows, outside, cone, passed, scale, moment } = view;
    if (told.attitude) craft.quaternion.copy(turn(at(told.attitude, moment)));
    if (told.position) {
      craft.position.copy(position(told, moment).multiplyScalar(scale));
      passed.geometry.setDrawRange(0, moment + 1);
    }
    if (told.jets) {
      const forces = at(told.jets.a, moment);
      plumes.forEach((plume, i) => {
        const most = told.jets.most[i] ?? 1;
        const length = (0.75 * Math.abs(forces[i])) / most;
        plume.visible = length > 2e-3;
        plume.scale.set(0.4 + length, Math.max(length, 1e-3), 0.4 + length);
        plume.position.y = length / 2;
      });
    }
    for (const wheel of wheels) {
      wheel.disc.rotation.y = wheel.angles[moment];
      const share = Math.abs(wheel.speeds[moment] ?? 0) / wheel.most;
      wheel.paint.color.set(record.colour("quiet")).lerp(new THREE.Color(record.colour("c1")), share);
    }
    for (const one of arrows) {
      const values = at(one.a, moment);
      const size = norm(values);
      const length = one.most > 0 ? (1.9 * size) / one.most : 0;
      one.arrow.userData.stretch(length);
      const direction = size > 0 ? vector(values).divideScalar(one.reversed ? -size : size) : UP();
      point(one.arrow, direction);
      if (one.frame === "reference") one.arrow.position.copy(craft.position);
      one.name.offset.copy(direction).multiplyScalar(length + 0.15);
      if (one.frame === "reference") one.name.offset.add(craft.position);
      one.name.hidden = length < 0.08;
    }
    for (const one of outside) {
      one.line.position.copy(craft.position);
      one.name.offset.copy(one.direction).multiplyScalar(2.05).add(craft.position);
    }
    if (cone) {
      const [lower, upper] = told.cone.map((wall) => at(wall, moment));
      const half = 4 * Math.atan(norm(lower.map((low, i) => Math.max(Math.abs(low), Math.abs(upper[i])))));
      cone.visible = half < Math.PI / 2;
      const long = 2;
      const wide = Math.min(Math.tan(half), 40) * long;
      cone.scale.set(wide, long, wide);
      cone.quaternion.setFromUnitVectors(UP(), new THREE.Vector3(-1, 0, 0));
      cone.position.set(long / 2, 0, 0);
    }
  }

  function draw() {
    if (!view || !view.dirty) return;
    view.dirty = false;
    pose();
    const { home, renderer, scene, camera, look, names } = view;
    const { clientWidth: width, clientHeight: height } = home;
    if (!width || !height) return;
    if (renderer.domElement.width !== Math.floor(width * renderer.getPixelRatio()) || renderer.domElement.height !== Math.floor(height * renderer.getPixelRatio())) {
      renderer.setSize(width, height, false);
      camera.aspect = width / height;
      camera.updateProjectionMatrix();
    }
    // z points up in the picture.
    camera.up.set(0, 0, 1);
    const away = look.away * Math.max(1, 1.15 / camera.aspect);
    camera.position.set(away * Math.cos(look.above) * Math.cos(look.around), away * Math.cos(look.above) * Math.sin(look.around), away * Math.sin(look.above));
    camera.lookAt(0, 0, 0);
    renderer.render(scene, camera);
    for (const one of names) {
      const place = one.object.localToWorld(one.offset.clone()).project(camera);
      const seen = !one.hidden && Math.abs(place.x) < 1 && Math.abs(place.y) < 1;
      one.element.hidden = !seen;
      if (seen) one.element.style.transform = `translate(${((place.x + 1) / 2) * width}px, ${((1 - place.y) / 2) * height}px) translate(-50%, -50%)`;
    }
  }

  function touch() {
    if (view) {
      view.dirty = true;
      draw();
    }
  }

  function hold(home) {
    let from = null;
    home.addEventListener("pointerdown", (event) => {
      from = [event.clientX, event.clientY];
      home.setPointerCapture(event.pointerId);
    });
    home.addEventListener("pointermove", (event) => {
      if (!from || !view) return;
      look("turn", (from[0] - event.clientX) * 0.008, (event.clientY - from[1]) * 0.008);
      from = [event.clientX, event.clientY];
    });
    home.addEventListener("pointerup", () => (from = null));
    home.addEventListener("pointercancel", () => (from = null));
    home.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-0.12, 0], ArrowRight: [0.12, 0], ArrowUp: [0, 0.12], ArrowDown: [0, -0.12] }[event.key];
      if (step) look("turn", ...step);
      else if (event.key === "+" || event.key === "=") look("near", 0.85);
      else if (event.key === "-") look("near", 1 / 0.85);
      else return;
      event.preventDefault();
    });
  }

  function look(how, a, b) {
    if (!view) return;
    if (how === "turn") {
      view.look.around += a;
      view.look.above = Math.min(1.5, Math.max(-1.5, view.look.above + b));
    } else view.look.away = Math.min(40, Math.max(2.5, view.look.away * a));
    touch();
  }

  // Show a scheme; false where there is nothing to show, or no WebGL to show it with.
  function show(home, scheme) {
    clear();
    if (!scheme.scene || !document.createElement("canvas").getContext("webgl2")) return false;
    view = build(home, scheme);
    touch();
    return true;
  }

  function clear() {
    if (!view) return;
    for (const one of view.names) one.element.remove();
    view.renderer.domElement.remove();
    view.renderer.dispose();
    view = null;
  }

  function moment(i) {
    if (!view) return;
    view.moment = i;
    touch();
  }

  const pointing = () => (view ? view.craft.quaternion.toArray() : null);
  const camera = () => (view ? view.camera.position.toArray() : null);
  const place = () => (view ? view.craft.position.toArray().map((value) => value / view.scale) : null);

  return { show, clear, moment, touch, look, hold, pointing, place, camera };
})();
