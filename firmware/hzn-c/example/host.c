/* The example on a workstation. */
#include <stdio.h>

int example(void);

void print(const char *text) {
    fputs(text, stdout);
}

int main(void) {
    return example();
}
