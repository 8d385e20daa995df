#include <catch2/catch.hpp>
#include <cmath>

#include "modules/simulation/rendering/exposure.hpp"

namespace km {
namespace {

RenderedView evenly_lit(float radiance) {
  RenderedView view;
  view.width = 8;
  view.height = 8;
  view.radiance.assign(64, radiance);
  return view;
}

TEST_CASE("The first frame is exposed to its target", "[simulation][exposure]") {
  const double gamma = GENERATE(1.0, 2.2);
  SensorEffectsConfig config;
  config.gamma = gamma;
  ExposureControl control(config, 20.0);
  const Exposure exposure = control.next(evenly_lit(0.2F));
  const double level = std::pow(0.2 * exposure.gain, 1.0 / gamma);
  CHECK(level == Approx(config.target_level).epsilon(1e-3));
}

TEST_CASE("The exposure follows a change of light with a lag, and settles",
          "[simulation][exposure]") {
  SensorEffectsConfig config;
  config.adaptation = 0.1;
  ExposureControl control(config, 20.0);
  (void)control.next(evenly_lit(0.8F));
  const RenderedView dark = evenly_lit(0.1F);
  double last = 0.0;
  double first_level = 0.0;
  for (int i = 0; i < 100; ++i) {
    const double level = control.next(dark).gain * 0.1;
    CHECK(level > last);  // no overshoot
    if (i == 0) first_level = level;
    last = level;
  }
  CHECK(first_level < 0.6 * config.target_level);
  CHECK(last == Approx(config.target_level).epsilon(0.01));
}

TEST_CASE("The pace of adaptation does not depend on the frame rate", "[simulation][exposure]") {
  const auto gain_after_one_second = [](double rate_hz) {
    ExposureControl control({}, rate_hz);
    (void)control.next(evenly_lit(0.8F));
    double gain = 0.0;
    for (int i = 0; i < static_cast<int>(rate_hz); ++i) gain = control.next(evenly_lit(0.3F)).gain;
    return gain;
  };
  CHECK(gain_after_one_second(10.0) == Approx(gain_after_one_second(40.0)).epsilon(0.02));
}

TEST_CASE("A dark scene opens the shutter to its limit", "[simulation][exposure]") {
  const SensorEffectsConfig config;
  ExposureControl bright(config, 20.0);
  const Exposure short_time = bright.next(evenly_lit(1.0F));
  CHECK(short_time.time_s == Approx(short_time.gain * config.unit_exposure_s));
  ExposureControl dim(config, 20.0);
  CHECK(dim.next(evenly_lit(0.01F)).time_s == config.max_exposure_s);
}

TEST_CASE("Exposure refuses what it cannot work with", "[simulation][exposure]") {
  CHECK_THROWS_AS(ExposureControl({}, 0.0), std::invalid_argument);
  SensorEffectsConfig config;
  config.target_level = 2.0;
  CHECK_THROWS_AS(ExposureControl(config, 20.0), ConfigError);
  ExposureControl control({}, 20.0);
  CHECK_THROWS_AS(control.next(RenderedView{}), std::invalid_argument);
}

}  // namespace
}  // namespace km
