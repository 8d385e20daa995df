#pragma once

#include <string>

#include "runtime/dds/dds_config.hpp"
#include "runtime/dds/network_interface.hpp"

namespace km {

/// Configuration document of Cyclone DDS 0.10 for `config` on `interface`.
[[nodiscard]] std::string cyclone_xml(const DdsConfig& config, const NetworkInterface& interface);

}  // namespace km
