#pragma once

#include <unistd.h>

#include <string>

#include "runtime/dds/dds_config.hpp"

namespace km {

/// Loopback, a domain and a team of this process alone: tests that run side by side never meet.
inline DdsConfig loopback_config() {
  static int count = 0;
  DdsConfig config;
  config.domain =
      static_cast<int>((static_cast<unsigned>(getpid()) * 7919U) % kLastQuietDomain) + 1;
  config.team = "test-" + std::to_string(getpid()) + '-' + std::to_string(++count);
  config.interface = "lo";
  config.spdp_interval_s = 0.2;
  return config;
}

}  // namespace km
