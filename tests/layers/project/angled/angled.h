// SPDX-License-Identifier: Apache-2.0
#pragma once

#ifndef NOTHING
#  include <upper/upper.h>
#endif
