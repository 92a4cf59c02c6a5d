/* What the example needs of its platform. */
#ifndef PLATFORM_H
#define PLATFORM_H
void put(const char *text);
#endif
