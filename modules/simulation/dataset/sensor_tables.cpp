#include "modules/simulation/dataset/sensor_tables.hpp"

#include "modules/simulation/dataset/number_text.hpp"

namespace km {
namespace {

void append(std::string& text, const Eigen::Vector3d& values) {
  for (int i = 0; i < 3; ++i) text += ',' + number_text(values[i]);
}

}  // namespace

std::string imu_csv(const std::vector<ImuSample>& samples) {
  std::string text =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  for (const ImuSample& sample : samples) {
    text += std::to_string(sample.stamp);
    append(text, sample.gyro);
    append(text, sample.accel);
    text += '\n';
  }
  return text;
}

std::string state_csv(const std::vector<TrueState>& states) {
  std::string text =
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
      "q_RS_z [],v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],b_w_RS_S_x [rad s^-1],"
      "b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],"
      "b_a_RS_S_z [m s^-2]\n";
  for (const TrueState& state : states) {
    const Eigen::Quaterniond q(state.T_world_body.linear());
    text += std::to_string(state.stamp);
    append(text, state.T_world_body.translation());
    text += ',' + number_text(q.w());
    append(text, q.vec());
    append(text, state.velocity_world);
    append(text, state.gyro_bias);
    append(text, state.accel_bias);
    text += '\n';
  }
  return text;
}

std::string image_csv(const std::vector<Stamp>& stamps, const std::string& extension) {
  std::string text = "#timestamp [ns],filename\n";
  for (const Stamp stamp : stamps)
    text += std::to_string(stamp) + ',' + std::to_string(stamp) + extension + '\n';
  return text;
}

}  // namespace km
