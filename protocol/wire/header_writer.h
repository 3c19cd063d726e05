// SPDX-License-Identifier: Apache-2.0
#pragma once

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

/// A text of at most `limit` bytes, cut before the UTF-8 character that does not fit. Empty text is
/// left out of the header.
Offset<flatbuffers::String> writeText(Builder& builder, std::string_view text, std::size_t limit);
Offset<Texts> writeNames(Builder& builder, const std::vector<std::string>& names);
Offset<fb::Camera> writeCamera(Builder& builder, const CameraInfo& camera);
fb::Pose toPose(const Transform<World, Camera>& world_from_camera);
Offset<fb::Frame> writeFrame(Builder& builder, const FrameMessage& message);

}  // namespace toftwin::wire
