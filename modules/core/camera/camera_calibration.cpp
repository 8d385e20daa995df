#include "modules/core/camera/camera_calibration.hpp"

#include "modules/core/geometry/lie.hpp"

namespace km {

CameraCalibration CameraCalibration::retracted(const CalibrationVector& delta) const {
  return {offset_s + delta(0), retract(SE3::Identity(), delta.segment<6>(1)) * T_body_rig,
          readout_s + delta(7)};
}

CalibrationVector CameraCalibration::local_coordinates_to(const CameraCalibration& to) const {
  CalibrationVector delta;
  delta << to.offset_s - offset_s,
      local_coordinates(SE3::Identity(), to.T_body_rig * T_body_rig.inverse()),
      to.readout_s - readout_s;
  return delta;
}

CameraCalibration CameraCalibration::composed_with(const CameraCalibration& correction) const {
  return {offset_s + correction.offset_s, T_body_rig * correction.T_body_rig,
          readout_s + correction.readout_s};
}

CameraCalibration CameraCalibration::without(const CameraCalibration& correction) const {
  return {offset_s - correction.offset_s, T_body_rig * correction.T_body_rig.inverse(),
          readout_s - correction.readout_s};
}

void CameraCalibration::apply_to(StereoRig& rig) const {
  for (Camera& camera : rig.cameras) camera.T_body_cam = T_body_rig * camera.T_body_cam;
}

}  // namespace km
