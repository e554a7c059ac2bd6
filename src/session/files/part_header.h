// The headers of part files, as JSON.
#pragma once

#include "session/files/part.h"

namespace strobe {

/// Returns the header as a line of JSON without a line end. It lacks the boxes.
std::string partHeaderToJson(const PartHeader& part);
/// Returns the header without its boxes; none if the text is not what partHeaderToJson returns.
std::optional<PartHeader> partHeaderFromJson(std::string_view text);

/// Returns the boxes as bytes.
std::string boxesToBytes(const std::vector<SampleBox>& boxes);
/// Returns the boxes; none if there are not kBoxBytes for each.
std::optional<std::vector<SampleBox>> boxesFromBytes(std::string_view bytes);
/// The number of bytes of a box.
inline constexpr size_t kBoxBytes = 24;

} // namespace strobe
