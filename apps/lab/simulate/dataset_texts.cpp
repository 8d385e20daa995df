#include "apps/lab/simulate/dataset_texts.hpp"

#include <iomanip>
#include <sstream>

#include "apps/lab/simulation/dataset/number_text.hpp"
#include "modules/core/label_palette.hpp"

namespace km {
namespace {

double path_length_m(const std::vector<TrueState>& states) {
  double length_m = 0.0;
  for (std::size_t i = 1; i < states.size(); ++i)
    length_m +=
        (states[i].T_world_body.translation() - states[i - 1].T_world_body.translation()).norm();
  return length_m;
}

void describe_rig(std::ostream& text, const SimulationOptions& options, const SensorRig& rig) {
  const Camera& left = rig.stereo.cameras[0];
  text << "## Sensors\n\n| sensor | figures |\n|---|---|\n"
       << "| cam0" << (options.cameras == CameraKind::kStereo ? ", cam1 | grey, " : " | grey, ")
       << left.width << 'x' << left.height << " px at " << number_text(options.rate_hz)
       << " Hz, focal length " << std::setprecision(4) << left.fx << " px, "
       << to_string(left.lens.model()) << " distortion";
  if (options.cameras == CameraKind::kStereo)
    text << ", baseline " << std::setprecision(3) << rig.stereo.baseline_m() << " m";
  text << " |\n";
  if (options.depth)
    text << "| depth0 | of cam0, pixel for pixel, at " << number_text(options.depth_rate_hz)
         << " Hz; 16 bit, mm along the optical axis, 0: none; "
         << (options.ideal_depth ? "true values" : "with the errors and holes of a stereo camera")
         << " |\n";
  if (options.labels) text << "| label0 | class ids of cam0's pixels, see below |\n";
  if (options.color) text << "| color0 | cam0 in colour |\n";
  text
      << "| imu0 | "
      << (options.is_recorded() ? "recorded"
                                : "simulated with the white noise and bias walk in its sensor.yaml")
      << ", " << number_text(rig.imu.rate_hz) << " Hz |\n"
      << "| state_groundtruth_estimate0 | true pose, velocity and biases |\n\n"
      << "The body frame is the inertial sensor's; `T_BS` in a sensor.yaml is the sensor's pose in "
         "it.\n\n";
}

void describe_robots(std::ostream& text, const SimulationOptions& options,
                     const std::vector<RobotScenario>& robots) {
  text << "## Robots\n\n| robot | frames | duration [s] | way [m] |\n|---|---|---|---|\n"
       << std::fixed << std::setprecision(1);
  for (const RobotScenario& robot : robots)
    text << "| " << robot.name << " | " << robot.images.size() << " | "
         << seconds_between(robot.images.front(), robot.images.back()) << " | "
         << path_length_m(robot.truth) << " |\n";
  text << '\n';
  if (!options.is_recorded()) return;
  text << "Their motion and inertial data were recorded; the images are rendered on the recorded "
          "poses.\n\n";
}

}  // namespace

std::string team_yaml(const SimulationOptions& options) {
  std::string text =
      "# The robots of these recordings:\n"
      "#   kimera_multi_team --config team.yaml --output results\n"
      "truth_mesh: world.ply\n";
  std::vector<std::string> settings;
  if (options.depth)
    settings.push_back(std::string("mapping.mode=") + (options.labels ? "semantic" : "metric"));
  if (options.depth && options.world == WorldKind::kViconRoom)
    settings.push_back("semantic_mapping.voxel_size_m=0.05");
  if (!options.is_recorded()) {
    text +=
        "# Simulated sensors are as their calibration states: odometry drifts less than the "
        "default.\n";
    settings.insert(settings.end(), {"vio.drift_rotation=2e-4", "vio.drift_translation=0.002"});
  }
  for (std::size_t i = 0; i < settings.size(); ++i)
    text += (i == 0 ? "arguments: [--set, " : ", --set, ") + settings[i];
  text += settings.empty() ? "robots:\n" : "]\nrobots:\n";
  for (std::size_t i = 0; i < options.names.size(); ++i) {
    const std::string& name = options.names[i];
    text += "  - id: " + std::to_string(i) + "\n    name: \"" + name + "\"\n    dataset: \"" +
            name + "\"\n    truth: \"" + name + "/mav0/state_groundtruth_estimate0/data.csv\"\n";
  }
  return text;
}

std::string dataset_readme(const SimulationOptions& options, const DatasetRecord& record,
                           const World& world, const std::vector<RobotScenario>& robots) {
  std::ostringstream text;
  text << "# Simulated recordings: " << name_of(options.world) << ", seed " << options.seed
       << "\n\nMade by " << record.generator << " with\n\n    " << command_line(options)
       << "\n\nThe same command makes the same bytes. Run a team on them with\n\n"
          "    kimera_multi_team --config team.yaml --output results\n\n";
  if (options.is_recorded())
    for (const auto& [name, value] : record.parameters)
      if (name.starts_with("recording ")) text << "- " << name << ": " << value << '\n';
  if (options.is_recorded()) text << '\n';
  describe_rig(text, options, robots.front().rig);
  describe_robots(text, options, robots);
  text << "## World\n\n`world.ply` is its true mesh: " << world.mesh.triangles.size()
       << " triangles with their class as `label`, in the frame of the true poses (metres, z "
          "up). `objects.json` has the true objects of the classes vehicle, pole, tent, person,\n"
          "furniture and object: their upright boxes in this frame.\n\n| id | class | red, green, "
          "blue |\n|---|---|---|\n";
  for (const LabelClass& label : simulation_palette().classes())
    text << "| " << static_cast<int>(label.id) << " | " << label.name << " | "
         << static_cast<int>(label.color[0]) << ", " << static_cast<int>(label.color[1]) << ", "
         << static_cast<int>(label.color[2]) << " |\n";
  text << "\nThe same as `label_palette.csv`.\n";
  return text.str();
}

}  // namespace km
