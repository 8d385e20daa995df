#include "apps/evaluate/closures.hpp"

#include <fstream>
#include <iostream>
#include <stdexcept>

#include "modules/core/json_writer.hpp"
#include "modules/evaluation/closure_files.hpp"
#include "modules/evaluation/closure_report.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/sensors/euroc_rig.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

fs::path mav0_of(const fs::path& dataset) {
  return fs::is_directory(dataset / "mav0") ? dataset / "mav0" : dataset;
}

}  // namespace

void evaluate_closures(const ClosuresCommand& command) {
  if (command.truths.size() != 1 && command.truths.size() != command.results.size())
    throw std::invalid_argument("give one --truth, or as many as there are --results");
  std::vector<TrueKeyframe> keyframes;
  std::vector<ClosureRecord> closures;
  for (std::size_t i = 0; i < command.results.size(); ++i) {
    const auto truth = read_trajectory(command.truths[command.truths.size() == 1 ? 0 : i]);
    const auto placed =
        place_keyframes(read_keyframes(command.results[i] / "keyframes.csv"), truth);
    keyframes.insert(keyframes.end(), placed.begin(), placed.end());
    const auto found = read_closures(command.results[i] / "loop_closures.csv");
    closures.insert(closures.end(), found.begin(), found.end());
  }
  const SensorRig rig = read_euroc_rig(mav0_of(command.dataset));
  const ClosureScores scores =
      score_closures(keyframes, closures, rig.stereo.cameras[0], command.options);
  std::cout << to_table(scores);
  if (command.json.empty()) return;
  std::ofstream file(command.json);
  JsonWriter json(file);
  write_json(json, scores);
  if (!file.flush()) throw std::runtime_error(command.json.string() + ": cannot be written");
}

}  // namespace km
