#include "modules/sensors/rig_file_codec.hpp"

#include "modules/sensors/euroc_rig_codec.hpp"
#include "runtime/config_text.hpp"
#include "runtime/yaml_config.hpp"

namespace km {

Rig read_rig_file(const std::filesystem::path& path) {
  ConfigProblems problems;
  const ConfigContext context{problems, std::filesystem::absolute(path).parent_path()};
  RigFile file;
  fill_config(read_section(load_yaml(path), "", path.string(), context), "", context, file);
  problems.finish();
  Rig rig;
  rig.topics = {.left = file.left.topic,
                .right = file.right.topic,
                .depth = file.depth.topic,
                .imu = file.imu.topic,
                .gyro = file.imu.gyro_topic,
                .accel = file.imu.accel_topic};
  rig.sensors = read_euroc_rig(find_mav0(file.calibration), !file.depth.topic.empty());
  rig.depth_scale_m = file.depth.scale_m;
  rig.camera_time_offset_s = file.camera_time_offset_s;
  return rig;
}

std::string rig_file_text(RigFile rig) {
  ConfigText text("");
  rig.visit_fields(text);
  return text.text();
}

}  // namespace km
