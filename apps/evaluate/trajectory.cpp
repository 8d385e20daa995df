#include "apps/evaluate/trajectory.hpp"

#include <cmath>
#include <deque>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include "apps/evaluate/named_files.hpp"
#include "modules/core/json_writer.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/evaluation/trajectory_plot.hpp"
#include "modules/evaluation/trajectory_report.hpp"

namespace km {
namespace {

constexpr double kAbsoluteFrom_s = 1e6;  // larger times are stamps, not seconds since the start

Stamp absolute(double t_s, Stamp start) {
  return nanoseconds(t_s) + (t_s < kAbsoluteFrom_s ? start : 0);
}

TimeWindow window_of(const TrajectoryCommand& command, const std::vector<StampedPose>& truth) {
  TimeWindow window = {truth.front().stamp, truth.back().stamp};
  const Stamp start = window.from;
  if (std::isfinite(command.from_s)) window.from = absolute(command.from_s, start);
  if (std::isfinite(command.to_s)) window.to = absolute(command.to_s, start);
  if (window.from >= window.to) throw std::invalid_argument("--from is not before --to");
  return window;
}

}  // namespace

void evaluate_trajectories(const TrajectoryCommand& command) {
  if (command.truths.size() != 1 && command.truths.size() != command.estimates.size())
    throw std::invalid_argument("give one --truth, or as many as there are --estimate");
  std::vector<std::vector<StampedPose>> truths;
  for (const auto& file : command.truths) truths.push_back(read_trajectory(file));
  std::deque<std::vector<StampedPose>> estimates;  // inputs refer to them
  std::vector<TrajectoryInput> inputs;
  for (std::size_t i = 0; i < command.estimates.size(); ++i) {
    const auto& truth = truths[truths.size() == 1 ? 0 : i];
    estimates.push_back(read_trajectory(command.estimates[i]));
    inputs.push_back(
        {short_name(command.estimates[i]), truth, estimates.back(), window_of(command, truth)});
  }

  const TeamError team = trajectory_error(inputs, command.options);
  std::cout << to_table(team);
  if (command.options.with_scale) std::cout << "scale " << team.alignment.scale << '\n';
  if (!command.json.empty()) {
    std::ostringstream text;
    JsonWriter json(text);
    write_json(json, team);
    write_file(command.json, text.str());
  }
  if (!command.plot.empty()) write_file(command.plot, plot_from_above(inputs, team));
}

}  // namespace km
