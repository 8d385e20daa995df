#pragma once

#include "modules/core/config.hpp"

namespace km {

/// Effects of a lens and a sensor on light; visit_fields() describes the fields, which are the keys
/// below `sensor:`.
struct SensorEffectsConfig {
  static constexpr const char* kSection = "sensor";

  double unit_exposure_s = 0.005;
  double max_exposure_s = 0.015;
  bool motion_blur = true;
  double rolling_shutter_s = 0.0;
  double passage_light = 1.0;
  double passage_every_s = 0.0;
  double passage_s = 3.0;
  double glare = 0.0;
  double dirt = 0.0;
  int dirt_spots = 20;
  int rain_drops = 0;

  void visit_fields(auto& visitor) {
    visitor.field("unit_exposure_s", unit_exposure_s, {1e-5, 1.0},
                  "s, shutter time at which a white wall in the sun saturates");
    visitor.field("max_exposure_s", max_exposure_s, {1e-5, 1.0},
                  "s; darker scenes are amplified instead, noise included");
    visitor.field("motion_blur", motion_blur, "smear along the motion while the shutter is open");
    visitor.field("rolling_shutter_s", rolling_shutter_s, {0.0, 0.2},
                  "s, from the first row to the last one; 0: all rows at the stamp");
    visitor.field("passage_light", passage_light, {1.0, 1000.0},
                  "factor of the light in bright passages; dark ones have its inverse");
    visitor.field("passage_every_s", passage_every_s, {0.0, 36000.0},
                  "s, mean time between the begins of passages; 0: none");
    visitor.field("passage_s", passage_s, {0.1, 36000.0}, "s, duration of a passage");
    visitor.field("glare", glare, {0.0, 2.0},
                  "share of the light of the sun or a lamp that the lens scatters over the image");
    visitor.field("dirt", dirt, {0.0, 1.0}, "share of light that spots of dirt on the lens hide");
    visitor.field("dirt_spots", dirt_spots, {0, 1000}, "spots on each lens");
    visitor.field("rain_drops", rain_drops, {0, 100000},
                  "falling drops within 6 m of the robot along each axis");
  }
};

}  // namespace km
