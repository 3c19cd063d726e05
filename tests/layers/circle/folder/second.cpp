// SPDX-License-Identifier: Apache-2.0
#include "folder/second.h"

#include "folder/first.h"
