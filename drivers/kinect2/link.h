// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "drivers/kinect2/commands.h"

/// The cable between the driver and a camera, so that the tests can hold its other end.
namespace toftwin::drivers::kinect2 {

/// Takes the packets of the stream, in their order and on one thread of the link's. Don't call the link back.
class PacketSink {
 public:
  virtual ~PacketSink() = default;
  virtual void packet(std::span<const std::byte> bytes) = 0;  ///< empty: between two images
  virtual void missed() = 0;                                  ///< one that the bus did not deliver
  virtual void lost(Error why) = 0;                           ///< no packet will come any more
};

/// An opened camera. One thread makes all calls.
class Link {
 public:
  virtual ~Link() = default;

  /// Endpoint 0x02; all of the bytes, within a second.
  virtual Result<> send(std::span<const std::byte> bytes) = 0;
  /// Endpoint 0x81: one message of at most so many bytes, within a second.
  virtual Result<Bytes> receive(std::size_t most) = 0;
  /// Whether the camera's video function is suspended; it takes commands only while it is not.
  virtual Result<> suspend(bool is_suspended) = 0;
  /// Alternate setting of the interface with the stream: 1 if on, 0 if not.
  virtual Result<> enableStream(bool on) = 0;
  /// Endpoint 0x84, isochronous, with so many transfers waiting at a time.
  virtual Result<> startPackets(PacketSink& sink, int transfers) = 0;
  /// After this the sink is not called any more.
  virtual void stopPackets() = 0;
};

struct Found {
  std::string name;     ///< as usb::KnownCamera says
  std::string serial;   ///< empty if the system does not say
  std::string port;     ///< "2-1.4"
  std::string warning;  ///< what is wrong with how it is connected, or nothing
};

class Bus {
 public:
  virtual ~Bus() = default;
  virtual std::vector<Found> cameras() = 0;
  /// `reset`: as if it had been unplugged and plugged in.
  virtual Result<std::unique_ptr<Link>> open(const Found& camera, bool reset) = 0;
};

/// The machine's own.
Bus& usbBus();

}  // namespace toftwin::drivers::kinect2
