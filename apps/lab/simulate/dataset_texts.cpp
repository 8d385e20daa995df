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

std::string list_of(const Eigen::MatrixXd& values) {
  std::string list;
  for (Eigen::Index row = 0; row < values.rows(); ++row)
    for (Eigen::Index column = 0; column < values.cols(); ++column)
      list += (list.empty() ? "" : ", ") + number_text(values(row, column));
  return '[' + list + ']';
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
  if (!options.is_recorded() && changed_keys(options.effects, 0).empty()) {
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
  if (!changed_keys(options.effects, 0).empty())
    text << "\n## Effects\n\n`effects.yaml` has the size of every effect. The folder `truth` of a "
            "robot has what it does not get:\nthe true calibration of its cameras, the errors of "
            "its inertial sensor and clocks, and the true\ntimes of its images. True states have "
            "the "
            "stamps of the robot's clock. `traffic.csv` has the\nposes of cars and people that "
            "move; they are not in `world.ply`.\n";
  return text.str();
}

std::string effects_yaml(const Effects& effects) {
  std::string text = "# All effects; a file of options may contain these sections.\n", section;
  for (const auto& [key, value] : key_texts(effects)) {
    const std::size_t dot = key.find('.');
    if (key.substr(0, dot) != section) text += (section = key.substr(0, dot)) + ":\n";
    text += "  " + key.substr(dot + 1) + ": " + value + '\n';
  }
  return text;
}

std::string true_errors_yaml(const RobotScenario& robot) {
  const InertialErrors& e = robot.inertial_errors;
  std::string text =
      "# measured = matrix * true + bias + noise + vibration; matrices row by row\ninertial:\n";
  const auto add = [&text](const char* key, const std::string& value) {
    text += std::string("  ") + key + ": " + value + '\n';
  };
  add("gyro_matrix", list_of(e.gyro_matrix));
  add("accel_matrix", list_of(e.accel_matrix));
  add("gyro_vibration_rps", list_of(e.gyro_vibration.transpose()));
  add("accel_vibration_mps2", list_of(e.accel_vibration.transpose()));
  add("vibration_hz", number_text(e.vibration_hz));
  add("vibration_phase_rad", list_of(e.phase.transpose()));
  add("gyro_warm_rps", list_of(e.gyro_warm.transpose()));
  add("accel_warm_mps2", list_of(e.accel_warm.transpose()));
  add("warm_up_s", number_text(e.warm_up_s));
  text += "clock:\n";
  add("drift", number_text(robot.clock.value().drift()));
  add("camera_drift", number_text(robot.clock.value().camera_drift()));
  std::string jumps;
  for (const Stamp jump : robot.clock.value().jumps())
    jumps += (jumps.empty() ? "" : ", ") + std::to_string(jump);
  add("jumps_at_ns", '[' + jumps + "]  # true times");
  return text;
}

std::string traffic_csv(const Traffic& traffic, const std::vector<RobotScenario>& robots) {
  std::vector<Eigen::AlignedBox3f> boxes;
  for (const WorldObject& object : traffic.shapes.objects) {
    Eigen::AlignedBox3f& box = boxes.emplace_back();
    for (std::size_t t = object.first_triangle; t < object.end_triangle; ++t)
      for (const std::uint32_t v : traffic.shapes.mesh.triangles[t])
        box.extend(traffic.shapes.mesh.vertices[v]);
  }
  std::string text =
      "#true time [ns],mover,label,p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z [],"
      "size_x [m],size_y [m],size_z [m]\n";
  const std::vector<Stamp>& times = robots.front().images;
  for (const Stamp time : times) {
    const std::vector<SE3> poses = traffic.poses(seconds_between(times.front(), time));
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const Eigen::Quaterniond q(poses[i].linear());
      const Eigen::Vector3d p = poses[i].translation(), size = boxes[i].sizes().cast<double>();
      text += std::to_string(time) + ',' + std::to_string(i) + ',' +
              std::to_string(static_cast<int>(traffic.label(i)));
      for (const double value :
           {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(), size.x(), size.y(), size.z()})
        text += ',' + number_text(value);
      text += '\n';
    }
  }
  return text;
}

std::string true_times_csv(const RobotScenario& robot) {
  std::string text = "#timestamp [ns],true time [ns]\n";
  for (std::size_t i = 0; i < robot.images.size(); ++i)
    text += std::to_string(robot.image_stamps[i]) + ',' + std::to_string(robot.images[i]) + '\n';
  return text;
}

}  // namespace km
