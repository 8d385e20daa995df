#pragma once

#include <cstdint>
#include <string>

#include "modules/core/map/label_palette.hpp"
#include "modules/view/view_update.hpp"

namespace km {

/// Message to the page as one frame: text (one JSON object), or binary.
struct PageMessage {
  bool binary = false;
  std::string bytes;
};

/// An update for the page: an object with n (`number`), t (time of sending [ms since 1970]),
/// robot, boot (hexadecimal), kind, and the members of the content under their names. Kinds are
/// "state", "pose", "keyframes", "closures", "mesh", "image", "objects", "raster". Poses are [x, y,
/// z, qx, qy, qz, qw] to 0.1 mm and 1e-5. Meshes, images and rasters are binary, little-endian:
/// length of the object [u32], the object, blanks up to a multiple of 4, then the data. A mesh has
/// offsets (u16), faces (u16), colours (u16) and labels (u8); an image has features (f32) and JPEG;
/// a raster has its runs. The chunks of the fused mesh of the team have `team`: their key has
/// another robot than the update (see read_run).
[[nodiscard]] PageMessage page_message(const ViewUpdate& update, std::uint64_t number);

/// Source of the messages that a page shows.
enum class PageSource {
  kTeam,  ///< A running team: "live".
  kRun,   ///< The journals of a run: "run".
};

/// First message to the page: the source (`source`), its name (`title`), and the colours of labels.
[[nodiscard]] std::string hello_message(PageSource source, const std::string& title,
                                        const LabelPalette& palette);

}  // namespace km
