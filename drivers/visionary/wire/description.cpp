// SPDX-License-Identifier: Apache-2.0
#include "drivers/visionary/wire/description.h"

#include <fmt/format.h>

#include <pugixml.hpp>
#include <sstream>

namespace toftwin::visionary {
namespace {

constexpr int kMostPixelsPerSide = 8192;
constexpr std::size_t kLongestXml = 1 << 20;

void add(pugi::xml_node to, const char* name, std::string_view text) {
  to.append_child(name).text().set(std::string{text}.c_str());
}
void add(pugi::xml_node to, const char* name, double number) { add(to, name, fmt::format("{:.9g}", number)); }

void addImage(pugi::xml_node to, const char* name, std::size_t bytes, const char* most) {
  if (bytes == 0) return;
  pugi::xml_node image = to.append_child(name);
  image.append_attribute("decimalexponent") = "0";
  image.append_attribute("min") = "1";
  image.append_attribute("max") = most;
  image.text().set(bytes == 1 ? "uint8" : "uint16");
}

void addDevice(pugi::xml_node set, const Description& of) {
  pugi::xml_node device = set.append_child("DeviceDescription");
  add(device, "Family", "V3SXX5-1");
  add(device, "Ident", of.ident);
  add(device, "Version", of.version);
  add(device, "SerialNumber", of.serial);
  add(device, "LocationName", "not defined");
  add(device, "IPAddress", of.address);
}

void addStream(pugi::xml_node format, const Description& of) {
  pugi::xml_node stream = format.append_child("DataStream");
  add(stream, "Interleaved", "false");
  add(stream, "Width", std::to_string(of.width));
  add(stream, "Height", std::to_string(of.height));
  pugi::xml_node world = stream.append_child("CameraToWorldTransform");
  for (const double one : of.camera_to_world) add(world, "value", one);
  pugi::xml_node matrix = stream.append_child("CameraMatrix");
  for (const auto& [name, value] : {std::pair{"FX", of.fx}, {"FY", of.fy}, {"CX", of.cx}, {"CY", of.cy}})
    add(matrix, name, value);
  pugi::xml_node distortion = stream.append_child("CameraDistortionParams");
  for (const auto& [name, value] :
       {std::pair{"K1", of.k1}, {"K2", of.k2}, {"P1", of.p1}, {"P2", of.p2}, {"K3", of.k3}})
    add(distortion, name, value);
  add(stream, "FrameNumber", "uint32");
  add(stream, "Quality", "uint8");
  add(stream, "Status", "uint8");
  pugi::xml_node pixel = stream.append_child("PixelSize");
  for (const auto& [name, value] : {std::pair{"X", 1.0}, {"Y", 1.0}, {"Z", 0.25}}) add(pixel, name, value);
  addImage(stream, "Distance", of.distance_bytes, "16384");
  addImage(stream, "Intensity", of.intensity_bytes, "20000");
  addImage(stream, "Confidence", of.state_bytes, "65535");
}

std::size_t bytesOf(std::string_view type) {
  return type == "uint8" ? 1 : type == "uint16" ? 2 : type == "uint32" ? 4 : 0;
}

void readMatrix(pugi::xml_node stream, Description& to) {
  std::size_t i = 0;
  for (const pugi::xml_node one : stream.child("CameraToWorldTransform").children()) {
    if (i < to.camera_to_world.size()) to.camera_to_world[i++] = one.text().as_double();
  }
}

}  // namespace

std::string toXml(const Description& description) {
  pugi::xml_document document;
  pugi::xml_node record = document.append_child("SickRecord");
  add(record, "Revision", "SICK V1.10 in work");
  pugi::xml_node set = record.append_child("DataSets").append_child("DataSetDepthMap");
  set.append_attribute("id") = "1";
  set.append_attribute("datacount") = "1";
  addDevice(set, description);
  pugi::xml_node format = set.append_child("FormatDescriptionDepthMap");
  format.append_child("TimestampUTC");
  add(format, "Version", "uint16");
  addStream(format, description);
  add(set.append_child("DataLink"), "FileName", "data.bin");
  std::ostringstream text;
  document.save(text, "", pugi::format_raw);
  return text.str();
}

Result<Description> readDescription(std::string_view xml) {
  pugi::xml_document document;
  if (xml.size() > kLongestXml || !document.load_buffer(xml.data(), xml.size()))
    return Error{Error::Code::Malformed, "Visionary: the blob's description is no XML"};
  const pugi::xml_node set = document.child("SickRecord").child("DataSets").child("DataSetDepthMap");
  const pugi::xml_node stream = set.child("FormatDescriptionDepthMap").child("DataStream");
  Description read;
  read.width = stream.child("Width").text().as_int();
  read.height = stream.child("Height").text().as_int();
  const auto isSide = [](int pixels) { return pixels > 0 && pixels <= kMostPixelsPerSide; };
  if (!isSide(read.width) || !isSide(read.height)) {
    return Error{
        Error::Code::Malformed,
        fmt::format("Visionary: the blob's description has images of {} x {}", read.width, read.height)};
  }
  readMatrix(stream, read);
  const pugi::xml_node matrix = stream.child("CameraMatrix"),
                       distortion = stream.child("CameraDistortionParams");
  const auto number = [](pugi::xml_node of, const char* name) { return of.child(name).text().as_double(); };
  read.fx = number(matrix, "FX");
  read.fy = number(matrix, "FY");
  read.cx = number(matrix, "CX");
  read.cy = number(matrix, "CY");
  read.k1 = number(distortion, "K1");
  read.k2 = number(distortion, "K2");
  read.p1 = number(distortion, "P1");
  read.p2 = number(distortion, "P2");
  read.k3 = number(distortion, "K3");
  read.focal_to_ray_cross_mm = number(stream, "FocalToRayCross");
  read.distance_bytes = bytesOf(stream.child("Distance").text().get());
  read.intensity_bytes = bytesOf(stream.child("Intensity").text().get());
  read.state_bytes = bytesOf(stream.child("Confidence").text().get());
  const pugi::xml_node device = set.child("DeviceDescription");
  read.ident = device.child("Ident").text().get();
  read.version = device.child("Version").text().get();
  read.serial = device.child("SerialNumber").text().get();
  read.address = device.child("IPAddress").text().get();
  return read;
}

}  // namespace toftwin::visionary
