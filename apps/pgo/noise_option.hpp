#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "apps/pgo/closure_noise.hpp"

namespace km {

/// Defines --noise-scale, with the same words in every program that has it. `scaled` says what is
/// multiplied: "--barc".
inline CLI::Option* add_noise_scale(CLI::App& app, NoiseModel& model, const std::string& scaled) {
  return app
      .add_option_function<std::string>(
          "--noise-scale", [&model](const std::string& text) { model = *parse_noise_model(text); },
          scaled +
              " by how many times larger the noise of\n"
              "closures is than the graph says, estimated from pairs of them: larger (never\n"
              "less than 1) or any; or by this number; off: believe the graph")
      ->check([](const std::string& text) {
        return parse_noise_model(text)
                   ? std::string()
                   : text + " is not off, larger, any, or a number from 0.01 to 1000";
      })
      ->default_str("off");
}

}  // namespace km
