#pragma once

#include <filesystem>

namespace km {

/// The world of apps/demo --short, as its test rendered it. ctest runs that test before those that
/// need the fixture demo_world.
inline const std::filesystem::path kDemoWorld = KM_BIN_DIR "/../test_demo_world";

/// Copies the world of a demo for other tests.
inline void keep_demo_world(const std::filesystem::path& world) {
  std::filesystem::remove_all(kDemoWorld);
  std::filesystem::copy(world, kDemoWorld, std::filesystem::copy_options::recursive);
}

}  // namespace km
