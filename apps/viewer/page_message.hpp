#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "modules/core/label_palette.hpp"
#include "modules/view/view_update.hpp"

namespace km {

/// What the page is told, as one frame of its WebSocket: text (one JSON object), or binary.
struct PageMessage {
  bool binary = false;
  std::string bytes;
};

/// An update for the page: an object with n (`number`), t (when it was told [ms since 1970]),
/// robot, boot (hexadecimal), kind ("state", "pose", "keyframes", "closures", "mesh", "image") and
/// the members of the content under their names; poses are [x, y, z, qx, qy, qz, qw] to 0.1 mm and
/// 1e-5. Meshes and images are binary, little-endian: length of the object [u32], the object,
/// blanks up to a multiple of 4, then of a mesh its offsets (u16), faces (u16), labels (u8), of an
/// image features (f32) and JPEG.
[[nodiscard]] PageMessage page_message(const ViewUpdate& update, std::uint64_t number);

/// What a page shows.
enum class PageSource {
  kTeam,    ///< That runs: "live".
  kReplay,  ///< A finished run, as if it were live: "replay".
  kRun,     ///< All of a finished run: "run".
};

/// What the page is told first: what it shows (`source`), of what (`title`), and the colours of
/// labels.
[[nodiscard]] std::string page_greeting(PageSource source, const std::string& title,
                                        const LabelPalette& palette);

}  // namespace km
