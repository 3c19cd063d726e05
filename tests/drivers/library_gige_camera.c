// SPDX-License-Identifier: Apache-2.0
// libaravis' own GigE Vision camera on the loopback network, until it is killed.
#include <arv.h>
#include <unistd.h>

int main(void) {
  ArvGvFakeCamera* camera = arv_gv_fake_camera_new("127.0.0.1", "LIB01");
  if (!arv_gv_fake_camera_is_running(camera)) return 1;
  for (;;) pause();
}
