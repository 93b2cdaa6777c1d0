// SPDX-License-Identifier: MIT
package burin;

/** A call of the C interface that failed: its status (burin_status in burin.h) and its one line of text. */
public final class BurinException extends RuntimeException {
    private static final long serialVersionUID = 1;
    public final int status;

    BurinException(int status, String message) {
        super(message);
        this.status = status;
    }
}
