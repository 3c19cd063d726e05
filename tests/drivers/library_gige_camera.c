// SPDX-License-Identifier: Apache-2.0
// libaravis' own GigE Vision camera on the loopback network, until it is killed. With a file of GenICam nodes as its
// argument these are added to its description, it has the format Coord3D_C16, and its images are codes that a test knows.
#include <arv.h>
#include <string.h>
#include <unistd.h>

/// The code at a pixel of a frame; 0, which says "no value", on the diagonal.
static guint16 codeAt(guint64 frame_id, gint x, gint y) {
  return x == y ? 0 : (guint16)(1000 + 4 * x + 16 * y + 7 * (frame_id % 64));
}

static void fill(ArvBuffer* buffer, void* data, guint32 exposure_us, guint32 gain, ArvPixelFormat format) {
  (void)data, (void)exposure_us, (void)gain, (void)format;
  // The library has made sure that the image fits; it says how many bytes there are only when they are filled in.
  guint16* codes = (guint16*)(guintptr)arv_buffer_get_data(buffer, NULL);
  const gint width = arv_buffer_get_image_width(buffer), height = arv_buffer_get_image_height(buffer);
  for (gint y = 0; y < height; ++y) {
    for (gint x = 0; x < width; ++x) *codes++ = codeAt(arv_buffer_get_frame_id(buffer), x, y);
  }
}

/// The library's description with the nodes of that file, in a file to be unlinked; NULL if it cannot be made.
static char* description(const char* file_of_nodes) {
  ArvFakeCamera* plain = arv_fake_camera_new("LIB01");
  size_t size = 0;
  const char* given = arv_fake_camera_get_genicam_xml(plain, &size);
  char* xml = g_strndup(given, size);
  g_object_unref(plain);
  char *nodes = NULL, *path = NULL;
  char* formats = strstr(xml, "<EnumEntry Name=\"BayerBG8\"");
  char* end = strstr(xml, "</RegisterDescription>");
  if (formats == NULL || end == NULL || !g_file_get_contents(file_of_nodes, &nodes, NULL, NULL)) return NULL;
  char* all = g_strdup_printf("%.*s<EnumEntry Name=\"Coord3D_C16\" NameSpace=\"Standard\"><Value>%u</Value></EnumEntry>%.*s%s%s",
                              (int)(formats - xml), xml, ARV_PIXEL_FORMAT_COORD3D_C_16, (int)(end - formats), formats,
                              nodes, end);
  const int file = g_file_open_tmp("toftwin_gige_XXXXXX.xml", &path, NULL);
  const gboolean is_written = file >= 0 && g_file_set_contents(path, all, -1, NULL);
  if (file >= 0) close(file);
  g_free(all), g_free(nodes), g_free(xml);
  return is_written ? path : NULL;
}

int main(int count, char** arguments) {
  char* xml = count > 1 ? description(arguments[1]) : NULL;
  if (count > 1 && xml == NULL) return 2;
  ArvGvFakeCamera* camera = arv_gv_fake_camera_new_full("127.0.0.1", "LIB01", xml);
  if (xml != NULL) unlink(xml);
  if (!arv_gv_fake_camera_is_running(camera)) return 1;
  if (xml != NULL) arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(camera), fill, NULL);
  for (;;) pause();
}
