% The hour in GNU Octave with lsode: octave-cli hour.m HOUR.json RUNS OUT.json
%
% HOUR.json is what hour.py gives; OUT.json gets the least seconds of a run by the clock and of the
% processor, and output and levels of the last.
% lsode goes from one change of the flow to the next, as plant.py has it, and restarts there.
1;

function dh = rates(h, t)
  global q k area d2
  x = h(1) - h(2);
  q1 = k(1) * h(1) / sqrt(sqrt(h(1) * h(1) + d2));
  q12 = k(2) * x / sqrt(sqrt(x * x + d2));
  q3 = k(3) * h(3) / sqrt(sqrt(h(3) * h(3) + d2));
  dh = [q - q1 - q12; q12; q1 - q3] / area;
end

function flow = pump(u, inputs, flows)
  i = min(max(lookup(inputs, u), 1), numel(inputs) - 1);
  share = min(max((u - inputs(i)) / (inputs(i + 1) - inputs(i)), 0), 1);
  flow = flows(i) + share * (flows(i + 1) - flows(i));
end

function [written, levels_cm] = run_hour(p, samples)
  global q
  inputs = p.curve(1, :);
  flows = p.curve(2, :);
  low_cm = p.range_cm(1);
  span_cm = p.range_cm(2) - low_cm;
  integral = p.kc * p.h_s / (2 * p.ti_s);
  noise = p.noise_cm * randn(samples, 1);
  times = [0, p.h_s / 2, p.h_s];
  air = repmat(pump(p.start_input, inputs, flows), 9, 1);
  mv = p.start_input;
  h = p.start_cm;
  written = zeros(samples, 1);
  levels_cm = zeros(samples, 3);
  for sample = 1:samples
    slot = mod(sample - 1, 9) + 1;
    q = air(slot);
    found = lsode("rates", h, times);
    h = found(3, :)';
    wanted_ma = 4 + 16 * (found(2, 2) + noise(sample) - low_cm) / span_cm;
    current_ma = round(min(max(wanted_ma, 3.8), 20.5) / p.code_ma) * p.code_ma;
    y = low_cm + span_cm * (current_ma - 4) / 16;
    r = p.setpoints_cm(mod(floor((sample - 1) / p.step_samples), 2) + 1);
    e = r - y;
    if sample == 1
      last = e;
    end
    mv = min(max(mv + p.kc * (e - last) + integral * (e + last), p.low_v), p.high_v);
    last = e;
    u = round(mv / p.dac_v) * p.dac_v;
    air(slot) = pump(u, inputs, flows);
    written(sample) = u;
    levels_cm(sample, :) = found(2, :);
  end
end

arguments = argv();
p = jsondecode(fileread(arguments{1}));
runs = str2double(arguments{2});
global q k area d2
k = p.k;
area = p.area_cm2;
d2 = p.delta2_cm2;
lsode_options("integration method", "adams");
lsode_options("relative tolerance", p.tolerance);
lsode_options("absolute tolerance", p.tolerance);
randn("seed", 1);
seconds = zeros(1, runs);
processor_s = zeros(1, runs);
run_hour(p, 100);
for i = 1:runs
  begun = tic();
  begun_processor = cputime();
  [written, levels_cm] = run_hour(p, p.samples);
  processor_s(i) = cputime() - begun_processor;
  seconds(i) = toc(begun);
end
out.version = version();
out.seconds = min(seconds);
out.processor_s = min(processor_s);
out.inputs = written;
out.levels_cm = levels_cm;
file = fopen(arguments{3}, "w");
fputs(file, jsonencode(out));
fclose(file);
