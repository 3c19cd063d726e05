// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin_generated.h>

#include "protocol/wire/bounds.h"
#include "protocol/wire/messages.h"

/// What encode.cpp and encode_frame.cpp share: values → parts of the FlatBuffers header.
namespace toftwin::wire {

using Builder = flatbuffers::FlatBufferBuilder;
template <class T>
using Offset = flatbuffers::Offset<T>;
using Texts = flatbuffers::Vector<Offset<flatbuffers::String>>;

/// What is longer than the protocol allows is written one byte or item longer than allowed: enough for
/// `faultIn` to name the field, and no size that a builder cannot hold.
template <class List>
std::size_t countOf(const List& list, std::size_t limit) {
  return std::min(list.size(), limit + 1);
}

/// A name, an id, a file name. Empty text is left out of the header.
Offset<flatbuffers::String> writeName(Builder& builder, std::string_view name);
/// A text for people, cut to kMaxText bytes before the UTF-8 character that does not fit.
Offset<flatbuffers::String> writeText(Builder& builder, std::string_view text);
Offset<Texts> writeNames(Builder& builder, const std::vector<std::string>& names);
Offset<fb::Camera> writeCamera(Builder& builder, const CameraInfo& camera);
fb::Pose toPose(const Transform<World, Camera>& world_from_camera);
Offset<fb::Frame> writeFrame(Builder& builder, const FrameMessage& message);

}  // namespace toftwin::wire
