#pragma once

#include "modules/core/config.hpp"

namespace km {

/// What a lens and a sensor do to light. Field names are the keys below `sensor:`.
struct SensorEffectsConfig {
  static constexpr const char* kSection = "sensor";

  /// Share of the light that the corners of the image lose; towards them it falls like the fourth
  /// power of a cosine.
  double vignetting = 0.2;

  /// Blur of the lens: standard deviation of its point spread [px]. With 0.6 the images of the
  /// Vicon room have the variance of the Laplacian that recorded ones have.
  double lens_blur_px = 0.6;

  /// Standard deviation of the noise in the dark, in grey levels.
  double read_noise = 1.0;

  /// Standard deviation of the photon noise just below saturation, in grey levels; it falls with
  /// the square root of the light.
  double photon_noise = 2.0;

  /// Correlation length of the noise [px]; 0: white. Recordings that went through a demosaic, a
  /// filter or JPEG have little of their noise left in the finest scale.
  double noise_correlation_px = 1.2;

  /// Exponent of the response curve: grey = signal^(1 / gamma). 1: linear.
  double gamma = 1.0;

  /// Mean grey level that the auto-exposure aims at, as a share of saturation.
  double target_level = 0.55;

  /// Share of the way to its target (in log exposure) that the exposure goes per frame at 20 Hz.
  double adaptation = 0.02;

  /// Shutter time at which a white wall in the sun saturates [s]; darker scenes open longer.
  double unit_exposure_s = 0.005;

  /// Longest shutter time [s]; darker scenes are amplified instead, noise included.
  double max_exposure_s = 0.015;

  /// Smear the image along its motion while the shutter is open.
  bool motion_blur = true;

  void visit_fields(auto& visitor) {
    visitor.field("vignetting", vignetting, {0.0, 0.9}, "share of light lost in the corners");
    visitor.field("lens_blur_px", lens_blur_px, {0.0, 5.0}, "px, standard deviation");
    visitor.field("read_noise", read_noise, {0.0, 50.0}, "grey levels");
    visitor.field("photon_noise", photon_noise, {0.0, 50.0}, "grey levels near saturation");
    visitor.field("noise_correlation_px", noise_correlation_px, {0.0, 4.0}, "px");
    visitor.field("gamma", gamma, {1.0, 3.0}, "grey = signal^(1 / gamma)");
    visitor.field("target_level", target_level, {0.05, 0.95}, "mean grey, share of saturation");
    visitor.field("adaptation", adaptation, {0.001, 1.0}, "share of the way per frame at 20 Hz");
    visitor.field("unit_exposure_s", unit_exposure_s, {1e-5, 1.0}, "s, white in the sun saturates");
    visitor.field("max_exposure_s", max_exposure_s, {1e-5, 1.0}, "s");
    visitor.field("motion_blur", motion_blur, "smear along the motion while the shutter is open");
  }
};

}  // namespace km
