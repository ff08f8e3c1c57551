// Tells the values of a plot's lines where the pointer is, and shows a plot large, to be zoomed and moved.
"use strict";
(() => {
  const tip = document.createElement("output");
  tip.className = "tip";
  document.body.append(tip);

  const valueAt = (line, x) => {
    let low = 0, high = line.x.length - 1;
    if (high < 0 || x < line.x[0] || x > line.x[high]) return null;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (line.x[middle] > x) high = middle; else low = middle;
    }
    const a = line.y[low], b = line.y[high];
    if (a === null || b === null) return null;
    const span = line.x[high] - line.x[low];
    return span > 0 ? a + (b - a) * (x - line.x[low]) / span : a;
  };

  const write = value => Math.abs(value) >= 1e-3 && Math.abs(value) < 1e5 || value === 0
    ? value.toPrecision(4) : value.toExponential(2);

  const tell = (svg, event) => {
    const spot = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    const axes = JSON.parse(svg.dataset.axes).find(({box}) =>
      spot.x >= box[0] && spot.x <= box[2] && spot.y >= box[1] && spot.y <= box[3]);
    tip.textContent = "";
    if (!axes) return;
    const x = axes.x[0] + (axes.x[1] - axes.x[0]) * (spot.x - axes.box[0]) / (axes.box[2] - axes.box[0]);
    const rows = axes.lines.map(line => [line.name, valueAt(line, x)]).filter(([, value]) => value !== null);
    tip.append(...[["at", x], ...rows].map(([name, value]) => {
      const row = document.createElement("div");
      row.textContent = `${name}  ${write(value)}`;
      return row;
    }));
    tip.style.left = `${Math.min(event.pageX + 14, document.documentElement.clientWidth - tip.offsetWidth - 8)}px`;
    tip.style.top = `${event.pageY + 14}px`;
    (svg.closest("dialog") || document.body).append(tip);
  };

  const enlarge = svg => {
    const dialog = document.createElement("dialog"), large = svg.cloneNode(true);
    const whole = svg.viewBox.baseVal, view = {x: whole.x, y: whole.y, width: whole.width, height: whole.height};
    const show = () => large.setAttribute("viewBox", `${view.x} ${view.y} ${view.width} ${view.height}`);
    const close = document.createElement("button");
    close.textContent = "close";
    close.onclick = () => dialog.close();
    large.addEventListener("wheel", event => {
      event.preventDefault();
      const part = Math.min(Math.max(Math.exp(event.deltaY / 400), whole.width / view.width / 20), whole.width / view.width);
      const spot = new DOMPoint(event.clientX, event.clientY).matrixTransform(large.getScreenCTM().inverse());
      view.x = spot.x - (spot.x - view.x) * part;
      view.y = spot.y - (spot.y - view.y) * part;
      view.width *= part;
      view.height *= part;
      show();
    }, {passive: false});
    large.addEventListener("pointermove", event => {
      if (event.buttons === 1) {
        const scale = large.getScreenCTM().a;
        view.x -= event.movementX / scale;
        view.y -= event.movementY / scale;
        show();
      }
      tell(large, event);
    });
    dialog.append(close, large);
    dialog.onclose = () => { document.body.append(tip); tip.textContent = ""; dialog.remove(); };
    document.body.append(dialog);
    dialog.showModal();
  };

  for (const svg of document.querySelectorAll("figure svg[data-axes]")) {
    svg.addEventListener("pointermove", event => tell(svg, event));
    svg.addEventListener("pointerleave", () => { tip.textContent = ""; });
    svg.addEventListener("click", () => enlarge(svg));
  }
})();
