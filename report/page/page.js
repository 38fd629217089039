'use strict';
// Reads figures off: a slider for each track moves a marker in all its figures, a pointer shows the
// nearest numbers. All words go in as text, never as markup.
(() => {
  const data = JSON.parse(document.getElementById('data').textContent);
  const svgNamespace = 'http://www.w3.org/2000/svg';
  const tracks = new Map(data.tracks.map((t) => [t.name, t]));
  const grids = new Map(data.grids.map((g) => [g.name, g]));
  document.documentElement.classList.add('js');

  // Six digits, as the tables' text has at most; every digit is in the files beside the report.
  const shown = (value) => value === null ? 'none' : String(Number(value.toPrecision(6)));
  const unit = (name) => name === 'degrees' ? '°' : name && name !== '1' ? ' ' + name : '';
  const bounded = (i, n) => Math.max(0, Math.min(n - 1, i));

  for (const t of data.tracks) {
    t.byKey = new Map(t.columns.map((c) => [c.key, c.values]));
    for (const c of t.columns) c.rounding = 1e-9 * c.values.reduce((most, v) => Math.max(most, Math.abs(v)), 0);
    // An eigenvalue up to 1e-12 of the largest is only rounding and has no damping ratio, as in the figures.
    t.zero = 1e-3 * Math.max(0, ...t.columns.filter((c) => /^(re|im)_/.test(c.key)).map((c) => c.rounding));
  }
  // A column's number; rounding next to the column's largest is 0.
  const shownOf = (column, value) => shown(value !== null && Math.abs(value) < column.rounding ? 0 : value);

  // A track's number at point i: its columns, and what follows from a mode's real and imaginary part.
  function valueAt(track, key, i) {
    const column = track.byKey.get(key);
    if (column) return column[i];
    const mode = /^(zeta|omega|height)_(\d+)$/.exec(key);
    if (!mode) return null;
    const re = track.byKey.get('re_' + mode[2])[i], im = track.byKey.get('im_' + mode[2])[i];
    if (re === null) return null;
    if (mode[1] === 'height') return Math.abs(im);
    const omega = Math.hypot(re, im);
    return mode[1] === 'omega' ? omega : omega <= track.zero ? null : -re / omega;
  }

  // Position of a value along an axis in the figure's own units; null outside.
  function place(axis, from, to, value) {
    if (value === null || value === undefined) return null;
    const f = axis.log ? Math.log : (v) => v;
    const share = (f(value) - f(axis.lower)) / (f(axis.upper) - f(axis.lower));
    return share < -1e-9 || share > 1 + 1e-9 || Number.isNaN(share) ? null : from + share * (to - from);
  }
  const across = (panel, value) => place(panel.x, panel.area[0], panel.area[1], value);
  const up = (panel, value) => place(panel.y, panel.area[3], panel.area[2], value);

  function element(parent, name, attributes) {
    const made = document.createElementNS(svgNamespace, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    parent.appendChild(made);
    return made;
  }

  for (const figure of data.figures) {
    figure.svg = document.querySelector(`svg[data-figure="${figure.name}"]`);
    figure.plot = figure.svg.parentElement;
    figure.tip = figure.plot.querySelector('.tip');
    for (const panel of figure.panels) {
      panel.cursors = ['x', 'y'].map(() => element(figure.svg, 'line', { class: 'cursor', visibility: 'hidden' }));
      for (const curve of panel.curves)
        curve.marker = element(figure.svg, 'circle',
          { class: 'marker', r: 4.5, style: `fill: var(--figure-${curve.colour})`, visibility: 'hidden' });
    }
  }

  function put(marker, x, y) {
    const here = x !== null && y !== null;
    marker.setAttribute('visibility', here ? 'visible' : 'hidden');
    if (!here) return;
    marker.setAttribute('cx', x);
    marker.setAttribute('cy', y);
  }
  function rule(line, x1, y1, x2, y2) {
    const here = [x1, y1, x2, y2].every((v) => v !== null);
    line.setAttribute('visibility', here ? 'visible' : 'hidden');
    if (!here) return;
    for (const [key, value] of Object.entries({ x1, y1, x2, y2 })) line.setAttribute(key, value);
  }
  const upright = (line, panel, x) => rule(line, x, panel.area[2], x, panel.area[3]);
  const level = (line, panel, y) => rule(line, panel.area[0], y, panel.area[1], y);

  // The number that a curve shows upright: a locus shows |Im|.
  const uprightKey = (panel, curve) => panel.y.key === 'im' ? curve.y.replace('im_', 'height_') : curve.y;

  // The mode that is complex conjugate to mode m at point i, or -1.
  function mate(track, m, i) {
    const re = valueAt(track, 're_' + m, i), im = valueAt(track, 'im_' + m, i);
    const near = (a, b) => Math.abs(a - b) <= 1e-9 * Math.hypot(re, im);
    return !im ? -1 : track.modes.findIndex((_, n) =>
      n !== m && near(valueAt(track, 're_' + n, i), re) && near(valueAt(track, 'im_' + n, i), -im));
  }
  function modeWords(track, m, i) {
    const re = valueAt(track, 're_' + m, i), im = valueAt(track, 'im_' + m, i), other = mate(track, m, i);
    const both = other < 0 ? [m] : [Math.min(m, other), Math.max(m, other)];
    const name = `${both.map((k) => k + 1).join(', ')} ${[...new Set(both.map((k) => track.modes[k]))].join('; ')}`;
    if (re === null) return `${name}: no equilibrium`;
    const zeta = valueAt(track, 'zeta_' + m, i);  // none at zero
    return `${name}: λ ${shown(re)}${im === 0 ? '' : ` ± ${shown(Math.abs(im))}i`}, ` +
      `ζ ${zeta === null ? '–' : shown(zeta)}, ω ${shown(valueAt(track, 'omega_' + m, i))} rad/s`;
  }
  const parameterWords = (track, i) => {
    const p = track.columns[0];
    return `${p.title} = ${shown(p.values[i])}${unit(p.unit)}`;
  };
  const curveWords = (track, curve, i) => {
    const column = track.columns.find((c) => c.key === curve.y);
    const mode = /^(re|im|zeta)_(\d+)$/.exec(curve.y);
    if (mode && track.modes.length) return modeWords(track, Number(mode[2]), i);
    return `${curve.title || column.title} ${shownOf(column, valueAt(track, curve.y, i))}${unit(column.unit)}`;
  };

  function moveTo(track, i) {
    track.at = i;
    for (const figure of data.figures)
      for (const panel of figure.panels) {
        if (figure.track === track.name) {
          for (const curve of panel.curves)
            put(curve.marker, across(panel, valueAt(track, curve.x, i)),
              up(panel, valueAt(track, uprightKey(panel, curve), i)));
          if (panel.x.key === 'parameter') upright(panel.cursors[0], panel, across(panel, track.columns[0].values[i]));
        }
        const grid = panel.map && grids.get(panel.map);
        if (!grid) continue;
        const value = track.columns[0].values[i], name = track.columns[0].title;
        if (grid.x.name === name) follow(grid, 0, nearest(grid.x.values, value));
        if (grid.y.name === name) follow(grid, 1, nearest(grid.y.values, value));
      }
    if (!track.input) return;
    track.input.value = i;
    const others = track.modes.length ? [...new Set(track.modes.map((_, m) => modeWords(track, m, i)))]
      : [track.columns.filter((c) => track.drawn.has(c.key)).map((c) => `${c.title} ${shownOf(c, c.values[i])}${unit(c.unit)}`).join(', ')];
    const words = [parameterWords(track, i), ...others].join('\n');
    track.input.setAttribute('aria-valuetext', parameterWords(track, i));
    track.output.textContent = '';
    for (const line of words.split('\n')) {
      const row = document.createElement('div');
      row.textContent = line;
      track.output.appendChild(row);
    }
  }

  function nearest(values, value) {
    let best = 0;
    for (let i = 1; i < values.length; i++)
      if (Math.abs(values[i] - value) < Math.abs(values[best] - value)) best = i;
    return best;
  }

  // ---- Maps ----
  const verdicts = ['stable', 'unstable', 'undecided'];
  function gridWords(grid, i, j) {
    const at = i * grid.y.values.length + j, verdict = grid.verdict[at];
    const words = verdict < 0 ? 'without trim'
      : `${verdicts[verdict]}, largest Re λ ${shown(grid.abscissa[at])} 1/s`;
    return [`${grid.x.name} = ${shown(grid.x.values[i])}${unit(grid.x.unit)}`,
      `${grid.y.name} = ${shown(grid.y.values[j])}${unit(grid.y.unit)}`, words];
  }
  function follow(grid, axis, i) {
    grid.at[axis] = i;
    for (const figure of data.figures)
      for (const panel of figure.panels) {
        if (panel.map !== grid.name) continue;
        upright(panel.cursors[0], panel, across(panel, grid.x.values[grid.at[0]]));
        level(panel.cursors[1], panel, up(panel, grid.y.values[grid.at[1]]));
      }
    grid.inputs.forEach((input, k) => { input.value = grid.at[k]; });
    grid.output.textContent = gridWords(grid, ...grid.at).join(', ');
  }

  // ---- Sliders ----
  for (const track of data.tracks) {
    track.drawn = new Set(data.figures.filter((f) => f.track === track.name)
      .flatMap((f) => f.panels).flatMap((p) => p.curves).map((c) => c.y));
    const controls = document.querySelector(`.controls[data-track="${track.name}"]`);
    track.input = controls && controls.querySelector('input');
    track.output = controls && controls.querySelector('output');
    if (track.input) track.input.addEventListener('input', () => moveTo(track, Number(track.input.value)));
  }
  for (const grid of data.grids) {
    const controls = document.querySelector(`.controls[data-grid="${grid.name}"]`);
    grid.inputs = [...controls.querySelectorAll('input')];
    grid.output = controls.querySelector('output');
    grid.at = [0, 0];
    grid.inputs.forEach((input, k) => input.addEventListener('input', () => follow(grid, k, Number(input.value))));
    follow(grid, 0, 0);
  }
  for (const track of data.tracks) moveTo(track, 0);

  // ---- Pointer ----
  // The point of a track nearest to the pointer: along the parameter, or of any curve.
  function nearestOf(track, panel, px, py) {
    let best = { distance: Infinity, i: 0, curve: null };
    for (const curve of panel.curves)
      for (let i = 0; i < track.columns[0].values.length; i++) {
        const x = across(panel, valueAt(track, curve.x, i));
        const y = up(panel, valueAt(track, uprightKey(panel, curve), i));
        if (x === null) continue;
        const distance = panel.x.key === 'parameter' ? Math.abs(x - px)
          : y === null ? Infinity : Math.hypot(x - px, y - py);
        if (distance < best.distance) best = { distance, i, curve };
      }
    return best;
  }

  function tell(figure, lines, event) {
    const { tip, plot } = figure;
    tip.textContent = '';
    for (const words of lines) {
      const row = document.createElement('div');
      row.textContent = words;
      tip.appendChild(row);
    }
    tip.style.display = 'block';
    const box = plot.getBoundingClientRect();
    const x = event.clientX - box.left, y = event.clientY - box.top;
    const left = x + tip.offsetWidth + 16 > box.width ? x - tip.offsetWidth - 12 : x + 12;
    tip.style.left = plot.scrollLeft + Math.max(0, Math.min(left, box.width - tip.offsetWidth)) + 'px';
    tip.style.top = Math.max(0, y - tip.offsetHeight - 8) + 'px';
  }

  function under(figure, event) {
    const box = figure.svg.getBoundingClientRect();
    const scale = figure.svg.viewBox.baseVal.width / box.width;
    const px = (event.clientX - box.left) * scale, py = (event.clientY - box.top) * scale;
    const panel = figure.panels.find((p) => px >= p.area[0] && px <= p.area[1] && py >= p.area[2] && py <= p.area[3]);
    return { panel, px, py };
  }

  function inverse(axis, from, to, at) {
    const share = (at - from) / (to - from);
    if (!axis.log) return axis.lower + share * (axis.upper - axis.lower);
    return axis.lower * (axis.upper / axis.lower) ** share;
  }

  for (const figure of data.figures) {
    const cell = (panel, px, py) => {
      const grid = grids.get(panel.map);
      return [grid, nearest(grid.x.values, inverse(panel.x, panel.area[0], panel.area[1], px)),
        nearest(grid.y.values, inverse(panel.y, panel.area[3], panel.area[2], py))];
    };
    figure.plot.addEventListener('pointermove', (event) => {
      const { panel, px, py } = under(figure, event);
      const track = tracks.get(figure.track);
      if (panel && panel.map) return tell(figure, gridWords(...cell(panel, px, py)), event);
      const found = panel && track && nearestOf(track, panel, px, py);
      if (!found || !found.curve) { figure.tip.style.display = 'none'; return; }
      const curves = panel.x.key === 'parameter' ? panel.curves : [found.curve];
      tell(figure, [parameterWords(track, found.i), ...new Set(curves.map((c) => curveWords(track, c, found.i)))], event);
    });
    figure.plot.addEventListener('pointerleave', () => { figure.tip.style.display = 'none'; });
    figure.plot.addEventListener('click', (event) => {
      const { panel, px, py } = under(figure, event);
      const track = tracks.get(figure.track);
      if (panel && panel.map) {
        const [grid, i, j] = cell(panel, px, py);
        follow(grid, 0, i);
        follow(grid, 1, j);
      } else if (panel && track) {
        const found = nearestOf(track, panel, px, py);
        if (found.curve) moveTo(track, found.i);
      }
    });
  }

  window.addEventListener('keydown', (event) => {
    if (event.key === 'Escape') for (const figure of data.figures) figure.tip.style.display = 'none';
  });

  // What is wider than the window is scrolled, by keyboard too.
  const reach = new ResizeObserver((entries) => {
    for (const { target } of entries)
      if (target.scrollWidth > target.clientWidth) target.tabIndex = 0; else target.removeAttribute('tabindex');
  });
  for (const wide of document.querySelectorAll('.plot, .table, pre')) reach.observe(wide);

  window.addEventListener('beforeprint', () => {
    for (const details of document.querySelectorAll('details')) details.open = true;
  });
})();
